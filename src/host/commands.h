// The commands behind `wisp WORD`; each returns the exit status or throws Error.
#pragma once
#include <string>
#include <vector>

namespace wisp {

int render_command(const std::vector<std::string> &arguments);
int plan_command(const std::vector<std::string> &arguments);

} // namespace wisp

// The commands behind `wisp WORD`; each returns the exit status or throws Error.
#pragma once
#include <string>
#include <vector>

namespace wisp {

int render_command(const std::vector<std::string> &arguments);
int plan_command(const std::vector<std::string> &arguments);

// `wisp inspect SCENE X Y`: how a pixel came to be what it is, as text, with --json as JSON.
int inspect_command(const std::vector<std::string> &arguments);

// `wisp merge A.passes B.passes ... -o FILE`: the picture (.png, .pfm) of all passes together, or their sums (.passes).
int merge_command(const std::vector<std::string> &arguments);

// `wisp stitch PART.pfm ... -o WHOLE`: the picture (.png, .pfm) of parts rendered with --crop.
int stitch_command(const std::vector<std::string> &arguments);

} // namespace wisp

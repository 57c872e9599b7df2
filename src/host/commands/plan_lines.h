// The stages of a plan, with what the numbers of the scene and the options add.
#pragma once
#include "host/commands/request.h"

namespace wisp {

struct PlanLine {
    std::string name, room;
    bool needed;
    uint64_t bytes;
    std::string reason; // what it does, or why it is not needed
};
std::vector<PlanLine> plan_lines(const Request &request, const PreparedScene &prepared, const Settings &settings,
                                 const Plan &plan);

} // namespace wisp

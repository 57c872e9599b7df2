#include "host/base/error.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/commands/memory_check.h"
#include "host/results/picture_bytes.h"
#include <algorithm>

namespace wisp {

namespace {

struct Change {
    const char *option;
    std::string value;
};

// Options that may make a plan smaller: first those that change the picture least.
std::vector<Change> changes_of(const PreparedScene &prepared, const Settings &settings, const Plan &plan) {
    std::vector<Change> changes = {{"shadows", "trace"}};
    for (double coarser : {1.25, 1.5, 2.0, 3.0})
        if (settings.density_step > 0) changes.push_back({"density-step", two_digits(settings.density_step * coarser)});
    for (double coarser : {1.5, 2.0, 4.0})
        if (settings.irradiance != IrradianceMap::none)
            changes.push_back({"irradiance-step", two_digits(settings.irradiance_step * coarser)});
    for (uint64_t fewer = 2; plan.photons && fewer <= 1024; fewer *= 2)
        changes.push_back({"photons", std::to_string(settings.photons / fewer)});
    changes.insert(changes.end(), {{"light-step", "0"}, {"irradiance", "none"}, {"smoke", "direct"}});
    for (int smaller : {2, 4, 8, 16})
        changes.push_back({"size", std::to_string(std::max(prepared.width / smaller, 1)) + "x" +
                                       std::to_string(std::max(prepared.height / smaller, 1))});
    return changes;
}

// The bytes that the request needs with that change; none where it is refused, or where its map would be.
std::optional<uint64_t> bytes_with(const Change &change, const Request &request, const PreparedScene &prepared,
                                   const Settings &settings, const Plan &before) {
    Request changed = {request.name, {}, request.options, request.frames, request.given}; // its file is not read again
    try {
        set_option(changed.options, change.option, change.value);
        check_options(changed);
        Settings with_change = settings_of(changed.options, prepared);
        if (change.option != std::string("size")) with_change.crop = settings.crop; // of inspect, one pixel
        const Plan plan = checked_plan(changed, prepared.scene, with_change);
        if (!request.options.map_in.empty() && fingerprint_of_map(changed, prepared, with_change, plan) !=
                                                   fingerprint_of_map(request, prepared, settings, before))
            return std::nullopt;
        return needed_bytes(with_change, plan);
    } catch (const Error &) {
        return std::nullopt;
    }
}

std::string advice(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan,
                   uint64_t most) {
    for (const Change &change : changes_of(prepared, settings, plan)) {
        const auto bytes = bytes_with(change, request, prepared, settings, plan);
        if (bytes && *bytes <= most)
            return std::string("; --") + change.option + " " + change.value + " needs " + std::to_string(*bytes);
    }
    return "";
}

} // namespace

void check_memory(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan,
                  uint64_t available) {
    const uint64_t picture = picture_bytes(settings, plan), needed = needed_bytes(settings, plan);
    const bool optional = request.options.memory && *request.options.memory <= available;
    const uint64_t most = optional ? *request.options.memory : available;
    if (needed <= most) return;
    const PlanRow &largest = *std::max_element(std::begin(plan.rows), std::end(plan.rows),
                                               [](const PlanRow &a, const PlanRow &b) { return a.bytes < b.bytes; });
    const bool rows = largest.bytes >= picture;
    throw Error(
        exit_memory, request.name,
        "the plan needs " + std::to_string(needed) + " bytes, " + std::to_string(rows ? largest.bytes : picture) +
            " of them for '" + (rows ? largest.name : "picture") + "', expected at most the " + std::to_string(most) +
            (optional ? " of --memory" : " that are available here") + advice(request, prepared, settings, plan, most));
}

bool Block::fit(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan) {
    const bool is_small = bytes_ < plan.arena_bytes;
    if (is_small) {
        memory_.reset();
        bytes_ = 0;
    }
    check_memory(request, prepared, settings, plan, available_memory() + bytes_);
    if (!is_small) return false;
    constexpr uint64_t line = 64;
    memory_.reset(static_cast<unsigned char *>(std::aligned_alloc(line, (plan.arena_bytes + line - 1) / line * line)));
    if (!memory_)
        throw Error(exit_memory, request.name,
                    "the plan needs " + std::to_string(plan.arena_bytes) +
                        " bytes, more than the system gives in one piece");
    bytes_ = plan.arena_bytes;
    return true;
}

} // namespace wisp

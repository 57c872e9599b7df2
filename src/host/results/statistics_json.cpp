#include "host/base/json_object.h"
#include "host/results/counters.h"
#include "host/results/statistics_json.h"
#include <iterator>

namespace wisp {

namespace {

std::string frame_json(const FrameReport &report) {
    if (report.kept)
        return Object().add("frame", static_cast<uint64_t>(report.frame)).add("kept", std::string("true")).text();
    const Statistics &s = report.statistics;
    Object frame, seconds;
    seconds.add("read", report.seconds.read).add("trees", report.seconds.trees).add("photons", report.seconds.photons);
    seconds.add("irradiance", report.seconds.irradiance)
        .add("render", report.seconds.render)
        .add("total", report.seconds.total);
    frame.add("frame", static_cast<uint64_t>(report.frame)).add("seconds", seconds);
    for (const Counter *counter = std::begin(counters); counter != std::end(counters);) {
        const std::string group = counter->group;
        Object object;
        for (; counter != std::end(counters) && counter->group == group; ++counter)
            object.add(counter->name, counter->value(s));
        if (group == "shadow" && s.shadow.checked) object.add("wrong_pixels", s.shadow.wrong_pixels);
        frame.add(group.c_str(), object);
    }
    Object stages;
    for (uint32_t i = 0; i < stage_count; ++i)
        stages.add(report.plan.rows[i].name,
                   Object().add("planned", report.plan.rows[i].bytes).add("used", s.bytes.stages[i]));
    frame.add("stages", stages);
    return frame.text();
}

} // namespace

std::string statistics_json(const RunReport &report) {
    std::string text = "{ \"wisp\": " + quoted(report.version) + ", \"arith\": " + quoted(report.arithmetic) +
                       ", \"digest\": " + quoted(report.digest) + ",\n  \"frames\": [";
    for (size_t i = 0; i < report.frames.size(); ++i) text += (i ? ",\n    " : "\n    ") + frame_json(report.frames[i]);
    return text + " ] }\n";
}

} // namespace wisp

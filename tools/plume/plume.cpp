// plume: smoke for wisp to render. Simulates a plume of warm air in a box of 65 x 19 x 26 units (plume_flow.h) and the
// particles that it carries (plume_particles.h), and writes frames as legacy VTK files.
// The same options give the same bytes on every machine.
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/messages.h"
#include "host/base/text.h"
#include "plume_particles.h"
#include "vtk_writer.h"
#include <cstdio>
#include <new>
#include <string>

namespace wisp::plume {

namespace {

constexpr int64_t max_frames = 10000, max_rate = 10000; // so that particles can be counted by 32 bits

const char *const usage =
    "plume -o FILE --frame F [options]               smoke particles of frame F as legacy VTK, binary\n"
    "plume -o FILE --frames A:B[:STEP] [options]     those of frames A to B, both included; FILE has a %04d\n"
    "\n"
    "Options, written --x V or --x=V; -o is --output:\n"
    "  --rate N   particles born a frame (400): frame F has N (F + 1) + 1\n"
    "  --sph      let the particles interact, which evens out their spacing\n"
    "  --seed N   another plume (1)\n"
    "Exit: 0 done, 2 wrong usage, 4 does not fit in memory, 5 could not write\n";

struct Request {
    std::string output;
    int64_t first = -1, last = -1, step = 1;
    uint32_t rate = 400;
    uint64_t seed = 1;
    bool sph = false;
};

[[noreturn]] void fail_usage(const std::string &what) {
    throw Error(exit_usage, what + "; 'plume --help' lists options");
}

int64_t integer_in(const std::string &option, const std::string &text, int64_t low, int64_t high) {
    const auto number = to_integer(text);
    if (!number || *number < low || *number > high)
        fail_usage("option '" + option + "': found '" + text + "', expected a whole number from " +
                   std::to_string(low) + " to " + std::to_string(high));
    return *number;
}

void set_frames(Request &request, const std::string &option, const std::string &text) {
    const size_t colon = text.find(':'), second = colon == std::string::npos ? colon : text.find(':', colon + 1);
    request.first = request.last = integer_in(option, text.substr(0, colon), 0, max_frames - 1);
    request.step = 1;
    if (colon != std::string::npos)
        request.last = integer_in(option, text.substr(colon + 1, second - colon - 1), request.first, max_frames - 1);
    if (second != std::string::npos) request.step = integer_in(option, text.substr(second + 1), 1, max_frames);
}

void set_option(Request &request, const std::string &option, const std::string &value) {
    if (option == "--output")
        request.output = value;
    else if (option == "--frame")
        request.first = request.last = integer_in(option, value, 0, max_frames - 1);
    else if (option == "--frames")
        set_frames(request, option, value);
    else if (option == "--rate")
        request.rate = static_cast<uint32_t>(integer_in(option, value, 1, max_rate));
    else if (option == "--seed")
        request.seed = static_cast<uint64_t>(integer_in(option, value, 0, INT64_MAX));
    else
        fail_usage("there is no option '" + option + "'");
}

Request parse(const std::vector<std::string> &words) {
    Request request;
    for (size_t i = 0; i < words.size(); ++i) {
        const size_t equals = words[i].find('=');
        std::string option = words[i].substr(0, equals);
        if (option == "-o") option = "--output";
        if (option == "--sph") {
            if (equals != std::string::npos) fail_usage("option '--sph' takes no value");
            request.sph = true;
        } else if (equals != std::string::npos) {
            set_option(request, option, words[i].substr(equals + 1));
        } else {
            set_option(request, option, i + 1 < words.size() ? words[i + 1] : "");
            ++i;
        }
    }
    if (request.output.empty()) fail_usage("found no output, expected -o FILE");
    if (request.first < 0) fail_usage("found no frame, expected --frame F or --frames A:B");
    if (request.first + request.step <= request.last && !has_number(request.output))
        fail_usage("option '--output': found '" + request.output + "' for several frames, expected a name with %04d");
    return request;
}

Bytes vtk_bytes(const SmokeVolume &smoke, const Velocity &air) {
    const uint32_t count = static_cast<uint32_t>(smoke.position().size());
    const std::string n = std::to_string(count);
    Bytes bytes = vtk_head("wisp plume", count);
    for (const Vec3 &p : smoke.position()) append_position(bytes, p);
    append(bytes, "\nVERTICES 1 " + std::to_string(count + 1) + "\n"); // one cell, so that viewers draw the points
    append(bytes, count);
    for (uint32_t i = 0; i < count; ++i) append(bytes, i);
    append(bytes, "\nPOINT_DATA " + n + "\nVECTORS velocity float\n");
    for (uint32_t i = 0; i < count; ++i) append_position(bytes, smoke.velocity(i, air));
    append(bytes, "\nSCALARS density float 1\nLOOKUP_TABLE default\n");
    for (const double density : smoke.density()) append(bytes, density);
    append(bytes, std::string("\n"));
    return bytes;
}

void simulate(const Request &request) {
    Flow flow(request.seed);
    SmokeVolume smoke(request.rate, request.seed, request.sph);
    for (int64_t frame = 0; frame <= request.last; ++frame) {
        flow.step();
        smoke.step(flow.velocity());
        if (frame >= request.first && (frame - request.first) % request.step == 0)
            write_file(numbered(request.output, frame), vtk_bytes(smoke, flow.velocity()));
    }
}

} // namespace

} // namespace wisp::plume

int main(int count, char **words) {
    const std::vector<std::string> arguments(words + 1, words + count);
    try {
        if (arguments.size() == 1 && (arguments[0] == "--help" || arguments[0] == "-h")) {
            std::fputs(wisp::plume::usage, stdout);
            return wisp::exit_done;
        }
        wisp::plume::simulate(wisp::plume::parse(arguments));
        return wisp::exit_done;
    } catch (const wisp::Error &error) {
        wisp::print_error(error, "plume");
        return error.status;
    } catch (const std::bad_alloc &) {
        wisp::print_error({wisp::exit_memory, "so many particles do not fit in memory"}, "plume");
        return wisp::exit_memory;
    }
}

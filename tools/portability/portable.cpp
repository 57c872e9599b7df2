// portable: renders scenes that are compiled in (scene_source), on processors and machines of any kind.
//
//     portable f32|f64|fixed
//
// prints `SHA-256  arithmetic  scene  options` of each as fixtures/goldens.txt has them. Where there is no command
// line, as in WebAssembly, portable_fault() is asked once and portable_line() for one line after the other.
#include "core/numbers/sample_sums.h"
#include "host/base/renderers.h"
#include "host/images/picture_digest.h"
#include "portability/compiled_scenes.h"
#include "core/numbers/self_test.h"
#include "wisp/settings.h"
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace wisp {

namespace {

template <class T> T *allocate(uint64_t count) {
    return count > SIZE_MAX / sizeof(T) ? nullptr
                                        : static_cast<T *>(std::malloc(static_cast<size_t>(count) * sizeof(T)));
}

const char *line_of(const Renderer &renderer, const CompiledScene &compiled) {
    const Scene &scene = compiled.scene;
    const Settings &settings = compiled.settings;
    const uint64_t bytes = renderer.plan(scene, settings).arena_bytes;
    const uint64_t pixels = static_cast<uint64_t>(compiled.width) * static_cast<uint64_t>(compiled.height);
    unsigned char *block = allocate<unsigned char>(bytes);
    float *rgb = allocate<float>(3 * pixels);
    PixelSums *sums = allocate<PixelSums>(pixels);
    if (!block || !rgb || !sums) return "there is not enough memory";
    Arena arena(block, static_cast<size_t>(bytes));
    Statistics statistics = {};
    Status status;
    Job job = {scene, settings, arena, statistics};
    if (settings.goal == Goal::reference) {
        for (uint64_t i = 0; i < pixels; ++i) sums[i] = {};
        job.pixels = sums;
        status = renderer.render(job);
        const double samples = static_cast<double>(settings.samples) * (settings.last_pass - settings.first_pass);
        for (uint64_t i = 0; i < 3 * pixels; ++i)
            rgb[i] = radiance_of(to_double(sums[i / 3].channels[i % 3].sum) / samples, scene.radiance_exponent);
    } else {
        job.rgb = rgb;
        status = renderer.render(job);
    }
    if (status != Status::done) return "the core has not rendered";
    const HexDigest digest = digest_of_picture(rgb, compiled.width, compiled.height);
    std::free(sums);
    std::free(rgb);
    std::free(block);

    static char line[256];
    size_t length = 0;
    for (const char *part : {digest.text, "  ", renderer.name, "  ", compiled.name}) {
        const size_t more = std::strlen(part);
        if (length + more >= sizeof line) return "the name of a scene is too long";
        std::memcpy(line + length, part, more + 1);
        length += more;
    }
    return line;
}

} // namespace

} // namespace wisp

// Why this machine cannot give the right bits, or nullptr.
extern "C" const char *portable_fault() { return wisp::arithmetic_fault(); }

// Of scene i = 0, 1, ... in arithmetic 0 (f32), 1 (f64) or 2 (fixed); nullptr behind the last. Until the next call.
extern "C" const char *portable_line(int arithmetic, int i) {
    return i < wisp::scene_count
               ? wisp::line_of(wisp::renderer_of(static_cast<wisp::Arithmetic>(arithmetic)), *wisp::scenes[i])
               : nullptr;
}

#ifndef __wasm__ // there it would import a command line and files
int main(int count, char **words) {
    int arithmetic = 0;
    const auto name = [&] { return wisp::renderer_of(static_cast<wisp::Arithmetic>(arithmetic)).name; };
    while (arithmetic < 3 && (count != 2 || std::strcmp(words[1], name()) != 0)) ++arithmetic;
    if (arithmetic == 3) {
        std::fprintf(stderr, "expected portable f32|f64|fixed\n");
        return 2;
    }
    if (const char *fault = portable_fault()) {
        std::fprintf(stderr, "this processor does not compute as wisp needs it: %s\n", fault);
        return 2;
    }
    for (int i = 0; const char *line = portable_line(arithmetic, i); ++i) {
        std::puts(line);
        std::fflush(stdout);
    }
    return 0;
}
#endif

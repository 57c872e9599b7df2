// Scene files: any bytes give a scene or one line that says what is wrong.
#include "host/error.h"
#include "host/options.h"
#include "host/scene_file.h"
#include <cmath>
#include <cstdlib>

namespace {

void promise(bool kept) {
    if (!kept) std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    try {
        const wisp::SceneFile scene = wisp::parse_scene("name", std::string(data, data + size));
        for (const auto &smoke : scene.smokes) {
            promise(smoke.phase > -1 && smoke.phase < 1);
            promise(smoke.extinction >= 0 && smoke.albedo.x >= 0 && smoke.albedo.x <= 1);
            promise(!smoke.radius || *smoke.radius > 0);
            wisp::numbered(smoke.file, 7);
        }
        for (const auto &light : scene.lights) promise(std::isfinite(light.color.x) && light.color.x >= 0);
        if (scene.view) promise(scene.view->width >= 1 && scene.view->height >= 1);
        wisp::Options options;
        for (const auto &setting : scene.defaults)
            wisp::set_option(options, setting.option, setting.value, setting.where);
    } catch (const wisp::Error &error) {
        const std::string line = error.what();
        promise(line.rfind("name:", 0) == 0);
        promise(line.find('\n') == std::string::npos);
    }
    return 0;
}

// A scene through the C interface is to the bit the one that the program prepares from the same numbers in a file.
#include "c_api/frame.h"
#include "core/smoke/grid_samples.h"
#include "host/prepare/prepare.h"
#include "support/c_scene.h"
#include "support/temporary_folder.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <fstream>

using namespace wisp;

namespace {

bool same(const Double3 &a, const Double3 &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

void check_same(const SmokeDescription &a, const SmokeDescription &b) {
    REQUIRE(a.count == b.count);
    CHECK(a.kernel == b.kernel);
    for (uint32_t i = 0; i < a.count; ++i) {
        CHECK(same(a.particles[i].position, b.particles[i].position));
        CHECK(a.particles[i].h == b.particles[i].h);
        CHECK(a.particles[i].area == b.particles[i].area);
    }
    REQUIRE(samples_of_box(a.grid) == samples_of_box(b.grid));
    CHECK(a.grid.nx == b.grid.nx);
    CHECK(a.grid.ny == b.grid.ny);
    CHECK(a.grid.extinction == b.grid.extinction);
    CHECK(same(a.grid.center, b.grid.center));
    CHECK(same(a.grid.half, b.grid.half));
    for (int k = 0; a.is_grid() && k < 3; ++k) CHECK(same(a.grid.axis[k], b.grid.axis[k]));
    REQUIRE((a.grid.density == nullptr) == (b.grid.density == nullptr));
    for (uint64_t i = 0; a.grid.density && i < samples_of_box(a.grid); ++i)
        CHECK(a.grid.density[i] == b.grid.density[i]);
    CHECK(a.smallest_h == b.smallest_h);
    CHECK(a.largest_h == b.largest_h);
    CHECK(a.total_area == b.total_area);
    CHECK(same(a.albedo, b.albedo));
    CHECK(a.asymmetry == b.asymmetry);
    CHECK(same(a.emission, b.emission));
}

void check_same(const Scene &a, const Scene &b) {
    CHECK(same(a.camera.origin, b.camera.origin));
    CHECK(same(a.camera.corner, b.camera.corner));
    CHECK(same(a.camera.right, b.camera.right));
    CHECK(same(a.camera.down, b.camera.down));
    CHECK(same(a.background, b.background));
    CHECK(a.radiance_exponent == b.radiance_exponent);
    CHECK(a.ray_epsilon == b.ray_epsilon);
    REQUIRE(a.light_count == b.light_count);
    for (uint32_t i = 0; i < a.light_count; ++i) {
        CHECK(a.lights[i].kind == b.lights[i].kind);
        CHECK(same(a.lights[i].position, b.lights[i].position));
        CHECK(same(a.lights[i].direction, b.lights[i].direction));
        CHECK(a.lights[i].one_minus_cosine == b.lights[i].one_minus_cosine);
        CHECK(same(a.lights[i].color, b.lights[i].color));
    }
    REQUIRE(a.smoke_count == b.smoke_count);
    for (uint32_t i = 0; i < a.smoke_count; ++i) check_same(a.smokes[i], b.smokes[i]);
    CHECK(a.static_count == b.static_count);
    CHECK(a.instance_triangle_count == b.instance_triangle_count);
    CHECK(a.deforming_count == b.deforming_count);
    for (uint32_t i = 0; i < a.triangle_count(); ++i) {
        for (int k = 0; k < 3; ++k) {
            CHECK(same(a.triangles[i].corner[k], b.triangles[i].corner[k]));
            CHECK(same(a.triangles[i].normal[k], b.triangles[i].normal[k]));
        }
        CHECK(a.triangles[i].material == b.triangles[i].material);
        CHECK(a.triangles[i].texture == b.triangles[i].texture);
    }
    REQUIRE(a.instance_count == b.instance_count);
    for (uint32_t i = 0; i < a.instance_count; ++i) {
        CHECK(a.instances[i].first == b.instances[i].first);
        CHECK(a.instances[i].count == b.instances[i].count);
        CHECK(a.instances[i].visible == b.instances[i].visible);
        CHECK(same(a.instances[i].origin, b.instances[i].origin));
        for (int k = 0; k < 3; ++k) CHECK(same(a.instances[i].axis[k], b.instances[i].axis[k]));
        for (int k = 0; k < 3; ++k) CHECK(same(a.instances[i].inverse[k], b.instances[i].inverse[k]));
    }
    REQUIRE(a.material_count == b.material_count);
    for (uint32_t i = 0; i < a.material_count; ++i)
        CHECK(std::memcmp(&a.materials[i], &b.materials[i], sizeof(Material)) == 0);
}

// The scene of a text that may name p.vtk, the particles, and g.vol, the grid, of a CScene.
class FileScene {
  public:
    FileScene(const CScene &from, const std::string &text) {
        std::ofstream particles(folder_.file("p.vtk"));
        particles.precision(9);
        particles << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 40 float\n";
        for (const float x : from.positions) particles << x << "\n";
        std::ofstream grid(folder_.file("g.vol"), std::ios::binary);
        const int32_t head[] = {1, 2, 2, 2, 1};
        const float box[] = {-1, 0, -1, 1, 4, 1};
        grid.write("VOL\3", 4).write(reinterpret_cast<const char *>(head), sizeof head);
        grid.write(reinterpret_cast<const char *>(box), sizeof box);
        grid.write(reinterpret_cast<const char *>(from.density.data()), 8 * sizeof(float));
        particles.close(), grid.close();
        prepare_scene("s.aff", parse_scene(folder_.file("s.aff"), text), {}, 0, prepared_);
    }
    const Scene &scene() const { return prepared_.scene; }

  private:
    TemporaryFolder folder_;
    PreparedScene prepared_;
};

const std::string head = "v from 0 2 9 at 0 1 0 up 0 1 0 angle 40 hither 1 resolution 12 9\nb 0.25 0.25 0.25\n"
                         "lp 3 4 5  30 20 10\nld 1 -2 0  1 2 3\n";

} // namespace

TEST_CASE("c_api: particles and triangles that stand, move and deform are prepared as those of a scene file") {
    CScene from;
    const CFrame frame(from.scene);
    REQUIRE_MESSAGE(frame.status == WISP_DONE, frame.error.text);
    CHECK(std::string(frame.error.text) == "");
    const FileScene expected(from, CScene::text("p.vtk"));
    REQUIRE(expected.scene().static_count == 2);
    REQUIRE(expected.scene().instance_count == 1);
    REQUIRE(expected.scene().deforming_count == 1);
    check_same(frame.frame->scene, expected.scene());
}

TEST_CASE("c_api: smoke alone, surfaces alone, and a background alone") {
    CScene from;
    from.scene.mesh_count = from.scene.material_count = 0;
    const std::string smoke =
        "smoke p.vtk {\n radius 0.2\n mass 1\n extinction 0.02\n albedo 0.9 0.8 0.7\n phase 0.25\n}\n";
    check_same(CFrame(from.scene).frame->scene, FileScene(from, head + smoke).scene());
    from.scene.smoke_count = 0;
    check_same(CFrame(from.scene).frame->scene, FileScene(from, head).scene());
    CScene other;
    other.scene.smoke_count = 0;
    std::string text = CScene::text("p.vtk");
    const size_t begin = text.find("smoke"), end = text.find("}\n", begin) + 2;
    check_same(CFrame(other.scene).frame->scene, FileScene(other, text.erase(begin, end - begin)).scene());
}

TEST_CASE("c_api: a grid, a box, a spot and a constant light, emission and poly6") {
    CScene from;
    from.scene.mesh_count = from.scene.material_count = 0;
    wisp_smoke three[3] = {from.smokes[0], from.smokes[0], from.smokes[0]};
    three[0].kernel = WISP_POLY6;
    CScene::set(three[0].emission, 1, 2, 3);
    three[1].kind = WISP_GRID;
    for (uint32_t &cells : three[1].cells) cells = 2;
    three[1].density.data = from.density.data();
    CScene::set(three[1].low, -1, 0, -1), CScene::set(three[1].high, 1, 4, 1);
    three[2].kind = WISP_BOX;
    CScene::set(three[2].low, -1, 0, -1), CScene::set(three[2].high, 2, 1, 1);
    three[2].extinction = 0.5;
    from.scene.smokes = three;
    from.scene.smoke_count = 3;
    from.lights[0].kind = WISP_SPOT;
    CScene::set(from.lights[0].direction, -1, -1, -2);
    from.lights[0].degrees = 30;
    from.lights[1].kind = WISP_CONSTANT;
    CScene::set(from.lights[1].position, 1, 2, 3);
    const std::string common = " extinction 0.02\n albedo 0.9 0.8 0.7\n phase 0.25\n";
    const FileScene expected(from, head.substr(0, head.find("lp")) +
                                       "ls 3 4 5  -1 -1 -2  30  30 20 10\nl 1 2 3  1 2 3\n"
                                       "smoke p.vtk {\n radius 0.2\n mass 1\n kernel poly6\n emission 1 2 3\n" +
                                       common + "}\nsmoke g.vol {\n" + common +
                                       "}\nsmoke box -1 0 -1 2 1 1 0.5 {\n albedo 0.9 0.8 0.7\n phase 0.25\n}\n");
    const CFrame frame(from.scene);
    REQUIRE_MESSAGE(frame.status == WISP_DONE, frame.error.text);
    check_same(frame.frame->scene, expected.scene());
}

TEST_CASE("c_api: the same numbers in any order, stride, step, width and alignment are the same scene") {
    CScene packed;
    const CFrame expected(packed.scene);
    CScene from;
    wisp_smoke &smoke = from.smokes[0];
    // Backwards, as 64-bit numbers; x, y and z in three rows; a radius and a mass each, one byte off.
    std::vector<double> rows(121);
    for (size_t i = 0; i < 120; ++i) rows[i % 3 * 40 + (39 - i / 3)] = static_cast<double>(from.positions[i]);
    std::vector<unsigned char> odd(40 * 20 + 1);
    for (size_t i = 0; i < 40; ++i) {
        const double radius = 0.2;
        const float mass = 1;
        std::memcpy(&odd[1 + 20 * i], &radius, sizeof radius);
        std::memcpy(&odd[1 + 20 * i + 12], &mass, sizeof mass);
    }
    smoke.positions = {rows.data() + 39, WISP_FLOAT64, -8, 320};
    smoke.radii = {&odd[1], WISP_FLOAT64, 20, 0};
    smoke.masses = {&odd[13], WISP_FLOAT32, 20, 0};
    smoke.radius = smoke.mass = 0;
    from.meshes[0].indices = nullptr; // each corner by itself
    std::vector<float> six;
    for (const uint32_t k : from.halves)
        for (size_t c = 0; c < 3; ++c) six.push_back(static_cast<float>(from.ground[3 * k + c]));
    from.meshes[0].positions = {six.data(), WISP_FLOAT32, 12, 4};
    from.meshes[0].vertex_count = 6;
    const CFrame frame(from.scene);
    REQUIRE_MESSAGE(frame.status == WISP_DONE, frame.error.text);
    check_same(frame.frame->scene, expected.frame->scene);
}

TEST_CASE("c_api: wrong scenes are refused with a line that says where and what was expected") {
    const double nan = std::nan(""), infinity = INFINITY;
    struct Case {
        const char *line;
        void (*spoil)(CScene &from);
        wisp_status status = WISP_BAD_SCENE;
    };
    static double bad;
    const Case cases[] = {
        {"scene.version: found 2, expected 1", [](CScene &s) { s.scene.version = 2; }, WISP_WRONG_USAGE},
        {"width, height: found 0 x 9", [](CScene &s) { s.scene.width = 0; }},
        {"width, height: found 12 x 65537", [](CScene &s) { s.scene.height = 65537; }},
        {"lights: found NULL, expected 2", [](CScene &s) { s.scene.lights = nullptr; }},
        {"smokes: found NULL, expected 1", [](CScene &s) { s.scene.smokes = nullptr; }},
        {"meshes: found NULL", [](CScene &s) { s.scene.meshes = nullptr; }},
        {"materials: found NULL", [](CScene &s) { s.scene.materials = nullptr; }},
        {"camera.from", [](CScene &s) { s.scene.camera.from[1] = bad; }},
        {"camera.up: expected a direction", [](CScene &s) { CScene::set(s.scene.camera.up, 0, 0, 0); }},
        {"camera.up: found the direction of view", [](CScene &s) { CScene::set(s.scene.camera.up, 0, 1, 9); }},
        {"camera.from, camera.at: found one point", [](CScene &s) { CScene::set(s.scene.camera.at, 0, 2, 9); }},
        {"camera.angle", [](CScene &s) { s.scene.camera.angle = bad; }},
        {"camera.angle", [](CScene &s) { s.scene.camera.angle = 180; }},
        {"background", [](CScene &s) { s.scene.background[2] = -1; }},
        {"ambient", [](CScene &s) { s.scene.ambient[0] = bad; }},
        {"lights[1].kind", [](CScene &s) { s.lights[1].kind = 4; }},
        {"lights[1].kind", [](CScene &s) { s.lights[1].kind = -1; }},
        {"lights[0].position", [](CScene &s) { s.lights[0].position[0] = bad; }},
        {"lights[1].direction", [](CScene &s) { CScene::set(s.lights[1].direction, 0, 0, 0); }},
        {"lights[0].degrees", [](CScene &s) { s.lights[0].kind = WISP_SPOT, s.lights[0].direction[0] = 1; }},
        {"lights[0].color", [](CScene &s) { s.lights[0].color[1] = -1; }},
        {"smokes[0].kind", [](CScene &s) { s.smokes[0].kind = 3; }},
        {"smokes[0].count: found 2^32", [](CScene &s) { s.smokes[0].count = uint64_t{1} << 32; }},
        {"smokes[0].positions.data: found NULL", [](CScene &s) { s.smokes[0].positions.data = nullptr; }},
        {"smokes[0].positions.number", [](CScene &s) { s.smokes[0].positions.number = 2; }},
        {"smokes[0].positions: stride times count", [](CScene &s) { s.smokes[0].positions.stride = INT64_MIN; }},
        {"smokes[0].positions: stride times count", [](CScene &s) { s.smokes[0].positions.stride = INT64_MAX / 8; }},
        {"smokes[0].radii: stride times count",
         [](CScene &s) {
             s.smokes[0].radii = {s.positions.data(), 0, 4, INT64_MAX};
         }},
        {"smokes[0].positions[39]", [](CScene &s) { s.positions[119] = static_cast<float>(bad); }},
        {"smokes[0].radius: expected", [](CScene &s) { s.smokes[0].radius = 0; }},
        {"smokes[0].radius: expected", [](CScene &s) { s.smokes[0].radius = bad; }},
        {"smokes[0].radius: found one beside radii",
         [](CScene &s) {
             s.smokes[0].radii = {s.ground.data(), WISP_FLOAT64, 0, 0};
         }},
        {"smokes[0].radii[0]",
         [](CScene &s) {
             s.smokes[0].radii = {s.positions.data(), WISP_FLOAT32, 0, 0};
             s.smokes[0].radius = 0;
             s.positions[0] = 0;
         }},
        {"smokes[0].mass: expected", [](CScene &s) { s.smokes[0].mass = -1; }},
        {"smokes[0].masses[0]",
         [](CScene &s) {
             s.smokes[0].masses = {s.positions.data(), WISP_FLOAT32, 0, 0};
             s.smokes[0].mass = 0;
             s.positions[0] = -1;
         }},
        {"smokes[0].extinction", [](CScene &s) { s.smokes[0].extinction = bad; }},
        {"smokes[0].albedo", [](CScene &s) { s.smokes[0].albedo[0] = 1.5; }},
        {"smokes[0].phase", [](CScene &s) { s.smokes[0].phase = 1; }},
        {"smokes[0].emission", [](CScene &s) { s.smokes[0].emission[0] = bad; }},
        {"smokes[0].kernel", [](CScene &s) { s.smokes[0].kernel = 2; }},
        {"smokes[0].cells: expected 1", [](CScene &s) { s.smokes[0].kind = WISP_GRID; }},
        {"smokes[0].cells: found more than 2^40",
         [](CScene &s) {
             s.smokes[0].kind = WISP_GRID;
             for (uint32_t &cells : s.smokes[0].cells) cells = INT32_MAX;
         }},
        {"smokes[0].density.data: found NULL",
         [](CScene &s) {
             s.smokes[0].kind = WISP_GRID;
             for (uint32_t &cells : s.smokes[0].cells) cells = 2;
         }},
        {"smokes[0].low, high", [](CScene &s) { s.smokes[0].kind = WISP_BOX; }},
        {"smokes: they reach more than 8192 of their smallest radii or cells from the meshes' middle",
         [](CScene &s) { s.positions[0] = 1e6f; }},
        {"smokes: they reach too far beside the meshes, expected at most 65536 times as far",
         [](CScene &s) { s.positions[0] = 1e6f, s.smokes[0].radius = 1000; }},
        {"smokes: they reach more than 8192 of their smallest radii or cells from their middle",
         [](CScene &s) {
             s.positions[0] = 1e6f;
             s.scene.mesh_count = 0;
         }},
        {"meshes[1].motion", [](CScene &s) { s.meshes[1].motion = 3; }},
        {"meshes[0].triangle_count: found 2^32", [](CScene &s) { s.meshes[0].triangle_count = uint64_t{1} << 32; }},
        {"meshes[1].vertex_count", [](CScene &s) { s.meshes[1].vertex_count = 2; }},
        {"meshes[0].positions.data: found NULL", [](CScene &s) { s.meshes[0].positions.data = nullptr; }},
        {"meshes[0].indices[5]", [](CScene &s) { s.halves[5] = 4; }},
        {"meshes[2].positions[1]", [](CScene &s) { s.folding[4] = bad; }},
        {"meshes[1].normals[2]", [](CScene &s) { s.upward[8] = bad; }},
        {"meshes[2].material: found 2, expected below 2", [](CScene &s) { s.meshes[2].material = 2; }},
        {"meshes[1].transform", [](CScene &s) { s.meshes[1].transform[3] = bad; }},
        {"meshes: something moves more than four times", [](CScene &s) { s.meshes[1].transform[9] = 1e5; }},
        {"meshes: something moves more than four times", [](CScene &s) { s.folding[4] = 1e5; }},
        {"materials[1].ambient, diffuse, specular", [](CScene &s) { s.materials[1].specular[0] = -1; }},
        {"materials[0].shininess", [](CScene &s) { s.materials[0].shininess = bad; }},
        {"materials[0].transmission", [](CScene &s) { s.materials[0].transmission = 2; }},
        {"materials[0].index", [](CScene &s) { s.materials[0].index = -1; }},
    };
    for (const Case &c : cases)
        for (const double value : {nan, infinity, -infinity}) {
            CAPTURE(std::string(c.line));
            bad = value;
            CScene from;
            c.spoil(from);
            // So much memory that its size is not what is refused.
            std::vector<unsigned char> memory(1 << 20);
            wisp_frame *frame = reinterpret_cast<wisp_frame *>(&from);
            wisp_error error;
            CHECK(wisp_prepare(&from.scene, memory.data(), memory.size(), &frame, &error) == c.status);
            CHECK(frame == nullptr);
            const std::string line = error.text;
            CHECK_MESSAGE(line.rfind(c.line, 0) == 0, line);
            CHECK_MESSAGE((line.find("expected") != std::string::npos || line.find("addressed") != std::string::npos),
                          line);
            CHECK(wisp_prepare(&from.scene, memory.data(), memory.size(), &frame, nullptr) == c.status);
        }
}

TEST_CASE("c_api: a scene takes no byte more than it says, and is refused with one fewer") {
    CScene from;
    const size_t bytes = wisp_prepared_bytes(&from.scene);
    REQUIRE(bytes > 0);
    for (size_t shift = 0; shift < 3; ++shift) {
        std::vector<unsigned char> memory(bytes + 100, 0xa5);
        wisp_frame *frame;
        wisp_error error;
        CHECK(wisp_prepare(&from.scene, memory.data() + shift, bytes - 1, &frame, &error) == WISP_NO_MEMORY);
        CHECK(std::string(error.text) ==
              "memory: found " + std::to_string(bytes - 1) + " bytes, expected " + std::to_string(bytes));
        CHECK(std::count(memory.begin(), memory.end(), 0xa5) == static_cast<std::ptrdiff_t>(memory.size()));
        CHECK(wisp_prepare(&from.scene, memory.data() + shift, bytes, &frame, &error) == WISP_DONE);
        CHECK(std::count(memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(shift), 0xa5) ==
              static_cast<std::ptrdiff_t>(shift));
        CHECK(std::count(memory.begin() + static_cast<std::ptrdiff_t>(shift + bytes), memory.end(), 0xa5) ==
              static_cast<std::ptrdiff_t>(100 - shift));
    }
    CHECK(wisp_prepare(&from.scene, nullptr, 0, nullptr, nullptr) == WISP_WRONG_USAGE);
    wisp_frame *frame;
    CHECK(wisp_prepare(&from.scene, nullptr, bytes, &frame, nullptr) == WISP_NO_MEMORY);
    CHECK(wisp_prepare(nullptr, &from, sizeof from, &frame, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_prepared_bytes(nullptr) == 0);
    from.scene.meshes = nullptr;
    CHECK(wisp_prepared_bytes(&from.scene) == 0);
}

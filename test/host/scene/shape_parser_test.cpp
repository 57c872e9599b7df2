// Materials and shapes as NFF and AFF write them.
#include "host/scene/scene_file.h"
#include "support/refusal.h"
#include <doctest/doctest.h>

using namespace wisp;

namespace {

SceneGraph graph_of(const std::string &text) { return parse_scene("dir/s.aff", text).graph; }

std::string error_of(const std::string &text) {
    return refusal_of([&] { parse_scene("s.aff", text); });
}

void check(const Double3 &found, double x, double y, double z) {
    CHECK(found.x == x);
    CHECK(found.y == y);
    CHECK(found.z == z);
}

using Three = std::array<uint32_t, 3>;
const std::string triangle = "p 3 0 0 0 1 0 0 0 1 0\n";

} // namespace

TEST_CASE("shapes: f and fm") {
    const SceneGraph g =
        graph_of("f 1 .5 .25 .5 .3 30 .75 1.5\n" + triangle + "fm .1 .2 .3 .4 .5 .6 .7 .8 .9 10 .5 0.0\n" + triangle);
    REQUIRE(g.materials.size() == 2);
    // Ambient and diffuse Kd R G B, specular Ks in white.
    check(g.materials[0].ambient, 0.5, 0.25, 0.125);
    check(g.materials[0].diffuse, 0.5, 0.25, 0.125);
    check(g.materials[0].specular, 0.3, 0.3, 0.3);
    CHECK(g.materials[0].shininess == 30);
    CHECK(g.materials[0].transmission == 0.75);
    CHECK(g.materials[0].index == 1.5);
    check(g.materials[1].ambient, 0.1, 0.2, 0.3);
    check(g.materials[1].diffuse, 0.4, 0.5, 0.6);
    check(g.materials[1].specular, 0.7, 0.8, 0.9);
    CHECK(g.materials[1].shininess == 10);
    CHECK(g.materials[1].transmission == 0.5);
    CHECK(g.materials[1].index == 0);
    CHECK(g.meshes[0].material == 0);
    CHECK(g.meshes[1].material == 1);
}

TEST_CASE("shapes: the material is the last one, braces or not; equal ones are one; before all there is a grey") {
    const std::string red = "f 1 0 0 1 0 1 0 0\n", green = "f 0 1 0 1 0 1 0 0\n",
                      single_channel = "f 1 1 1 .5 0 0 0 1\n";
    const SceneGraph g = graph_of(triangle + red + triangle + "x a {" + green + triangle + "}" + triangle +
                                  "fm 1 0 0 1 0 0 0 0 0 1 0 0\n" + triangle + single_channel + triangle);
    REQUIRE(g.materials.size() == 3);
    check(g.materials[0].ambient, 0.5, 0.5, 0.5);
    check(g.materials[0].diffuse, 0.5, 0.5, 0.5);
    check(g.materials[0].specular, 0, 0, 0);
    CHECK(g.materials[0].transmission == 0);
    const uint32_t materials[] = {0, 1, 2, 2, 1, 0};
    REQUIRE(g.meshes.size() == 6);
    for (size_t i = 0; i < 6; ++i) CHECK(g.meshes[i].material == materials[i]);
    CHECK(graph_of(red + triangle).materials.size() == 1); // no grey where nothing needs it
}

TEST_CASE("shapes: spheres, cones, cylinders, polygons and patches, over any lines") {
    for (const char *text :
         {"s 1 2 3 4", "s\n1 2\n3 -4", "c 0 0 0 1 0 0 1 1", "c 0 0 0 1 0 0 1 0", "c 0 0 0 0 0 0 1 2",
          "c 0 0 0 -1 0 0 1 -.5", "p 3 0 0 0 1 0 0 0 1 0", "pp 3 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1"}) {
        CAPTURE(text);
        const SceneGraph g = graph_of(std::string("x a {") + text + "}");
        REQUIRE(g.meshes.size() == 1);
        const Mesh &mesh = g.meshes[0];
        CHECK(!mesh.rows.empty());
        CHECK(mesh.node == 0);
        CHECK(mesh.material == 0);
        CHECK(mesh.texture == -1);
    }
    CHECK(graph_of("p 3 0 0 0 1 0 0 2 0 0").meshes.empty()); // no area
    const Mesh patch = graph_of("pp 3 0 0 0 0 0 1 1 0 0 0 0 2 0 1 0 0 0 3").meshes[0];
    REQUIRE(patch.normals.size() == 3);
    check(patch.positions[2], 0, 1, 0);
    check(patch.normals[1], 0, 0, 2);
}

TEST_CASE("shapes: meshes with and without normals and textures") {
    const std::string start = "m vertices 4 0 0 0 1 0 0 0 1 0 0 0 5\n", normals = "normals 2 0 0 2 0 3 0\n",
                      texels = "texturecoords 3 a.ppm .25 -1 2 3 4 5\n";
    const Mesh plain = graph_of(start + "triangles 2 0 1 2 3 2 1").meshes[0];
    check(plain.positions[3], 0, 0, 5);
    CHECK(plain.normals.empty());
    CHECK(plain.texels.empty());
    CHECK(plain.texture == -1);
    REQUIRE(plain.rows.size() == 2);
    CHECK(plain.rows[1].corner == Three{3, 2, 1});

    const Mesh smooth = graph_of(start + normals + "triangles 1 0 1 3 1 0 1").meshes[0];
    check(smooth.normals[1], 0, 3, 0);
    CHECK(smooth.rows[0].corner == Three{0, 1, 3});
    CHECK(smooth.rows[0].normal == Three{1, 0, 1});

    // Without normals the second triple is that of the texture.
    const SceneGraph g = graph_of(start + texels + "triangles 1 0 1 3 2 0 1");
    REQUIRE(g.textures.size() == 1);
    CHECK(g.textures[0].path == "dir/a.ppm");
    const Mesh &painted = g.meshes[0];
    CHECK(painted.texture == 0);
    CHECK(painted.texels[0] == std::array<double, 2>{0.25, -1});
    CHECK(painted.texels[2] == std::array<double, 2>{4, 5});
    CHECK(painted.rows[0].texel == Three{2, 0, 1});

    const Mesh both = graph_of(start + normals + texels + "triangles 1 0 1 3 1 1 0 2 0 1").meshes[0];
    CHECK(both.rows[0].corner == Three{0, 1, 3});
    CHECK(both.rows[0].normal == Three{1, 1, 0});
    CHECK(both.rows[0].texel == Three{2, 0, 1});
}

TEST_CASE("shapes: textured triangles; a texture is one however often it is named") {
    const SceneGraph g = graph_of("tt a.ppm 0 0 0 .1 .2 1 0 0 .3 .4 0 1 0 .5 .6\n"
                                  "ttp /b.ppm 0 0 0 0 0 1 .1 .2 1 0 0 0 1 0 .3 .4 0 1 0 1 0 0 .5 .6\n"
                                  "tt a.ppm 0 0 0 .1 .2 1 0 0 .3 .4 0 1 0 .5 .6\n");
    REQUIRE(g.textures.size() == 2);
    CHECK(g.textures[0].path == "dir/a.ppm");
    CHECK(g.textures[1].path == "/b.ppm");
    REQUIRE(g.meshes.size() == 3);
    CHECK(g.meshes[0].texture == 0);
    CHECK(g.meshes[1].texture == 1);
    CHECK(g.meshes[2].texture == 0);
    for (const Mesh &mesh : g.meshes) {
        REQUIRE(mesh.rows.size() == 1);
        CHECK(mesh.rows[0].corner == Three{0, 1, 2});
        CHECK(mesh.rows[0].texel == Three{0, 1, 2});
        check(mesh.positions[1], 1, 0, 0);
        CHECK(mesh.texels[1] == std::array<double, 2>{0.3, 0.4});
    }
    CHECK(g.meshes[0].normals.empty());
    CHECK(g.meshes[1].rows[0].normal == Three{0, 1, 2});
    check(g.meshes[1].normals[2], 1, 0, 0);
}

TEST_CASE("shapes: triangles that change their form") {
    const SceneGraph g = graph_of("f 1 1 1 1 0 0 0 0 x a { f 1 0 0 1 0 0 0 0\n"
                                  "tpa 2 -1 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1\n"
                                  " -1 0 0 0 0 0 1 2 0 0 0 0 1 0 2 0 0 1 0\n }");
    CHECK(g.meshes.empty());
    REQUIRE(g.deforming.size() == 1);
    CHECK(g.deforming[0].node == 0);
    CHECK(g.deforming[0].material == 1);
    REQUIRE(g.deforming[0].keyframes.size() == 2);
    CHECK(g.deforming[0].keyframes[0].time == -1);
    check(g.deforming[0].keyframes[1].corners[1], 2, 0, 0);
    check(g.deforming[0].keyframes[1].normals[2], 0, 1, 0);
}

TEST_CASE("shapes: errors") {
    const std::string start = "m vertices 3 0 0 0 1 0 0 0 1 0\n";
    const struct {
        std::string text, error;
    } cases[] = {
        {"f 1 1 1 .5 -1", "s.aff:1: found -1, expected a specular part Ks from 0 to 1000"},
        {"f 1 1 1 2000", "s.aff:1: found 2000, expected a diffuse part Kd from 0 to 1000"},
        {"fm 1 1 1 1 1 1\n0 0 1001", "s.aff:2: found a colour of a material above 1000, expected less"},
        {"f 1 -1 1", "s.aff:1: found -1, expected green of 0 or more of the material"},
        {"fm 1 1 1 1 1 1 1 1 1 -1", "s.aff:1: found -1, expected a shininess from 0 to 1e7"},
        {"f 1 1 1 1 1 2e7", "s.aff:1: found 2e7, expected a shininess from 0 to 1e7"},
        {"f 1 1 1 1 1 1 1 1001", "s.aff:1: found 1001, expected an index of refraction up to 1000"},
        {"f 1 1 1 1 1 1 1 1e-4", "s.aff:1: found index 1e-4, expected 0, or one from 0.001 to 1000"},
        {"tt a.ppm 0 0 0 1 8193", "s.aff:1: found 8193, expected v from -8192 to 8192"},
        {"fm 1 1 1 1 1 1\n1 1 1 1 1.5", "s.aff:2: found 1.5, expected a transmission from 0 to 1"},
        {"fm 1 1 1 1 1 1 1 1 1 1 1 nan", "s.aff:1: found 'nan', expected a number: an index of refraction up to 1000"},
        {"s 0 0 0 0", "s.aff:1: found radius 0, expected another"},
        {"s 0 0 inf 1", "s.aff:1: found 'inf', expected a number: z of the sphere's centre"},
        {"c 0 0 0 1 0 0 0 1", "s.aff:1: base and apex are the same point, expected two"},
        {"c 0 0 0 0 0 0 1 0", "s.aff:1: both radii are 0, expected at most one"},
        {"c 0 0 0 1 0 0 1 -1", "s.aff:1: one radius is below 0 and one above, expected the same sign"},
        {"p 2 0 0 0 1 0 0", "s.aff:1: found '2', expected a whole number from 3 to 2147483647: the polygon's corners"},
        {"p -3", "s.aff:1: found '-3', expected a whole number from 3 to 2147483647: the polygon's corners"},
        {"pp 0", "s.aff:1: found '0', expected a whole number from 3 to 2147483647: the patch's corners"},
        {"p 3.5", "s.aff:1: found '3.5', expected a whole number from 3 to 2147483647: the polygon's corners"},
        {"p 3 0 0 0 1 0 0 0\ns 0", "s.aff:2: found 's', expected a number: y of a corner"},
        {"m normals", "s.aff:1: found 'normals', expected 'vertices'"},
        {"m vertices 0", "s.aff:1: found '0', expected a whole number from 1 to 2147483647: the mesh's vertices"},
        {start + "texturecoords 1 a.ppm 0 0 normals 1 0 0 1", "s.aff:2: found 'normals', expected 'triangles'"},
        {start + "texturecoords 1 { 0 0", "s.aff:2: found '{', expected a texture's file"},
        {start + "triangles 1\n0 1 3", "s.aff:3: found '3', expected a whole number from 0 to 2: a triangle's vertex"},
        {start + "triangles 1\n0 1 -1",
         "s.aff:3: found '-1', expected a whole number from 0 to 2: a triangle's vertex"},
        {start + "normals 1 0 0 1 triangles 1 0 1 2 0 1 0",
         "s.aff:2: found '1', expected a whole number from 0 to 0: a triangle's normal"},
        {start + "texturecoords 1 a 0 0 triangles 1 0 1 2 0 0 7",
         "s.aff:2: found '7', expected a whole number from 0 to 0: a triangle's texture coordinates"},
        {"tpa 0", "s.aff:1: found '0', expected a whole number from 1 to 2147483647: the triangle's times"},
        {"tpa 2 1 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1\n0.5 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1",
         "s.aff:2: found time 0.5 behind a later one, expected ascending times"},
    };
    std::string huge = "p 16385\n";
    for (int i = 0; i < 16385; ++i) huge += "0 0 0\n";
    CHECK(error_of(huge) == "s.aff:16386: found a polygon of 16385 points, expected at most 16384");
    for (const auto &c : cases) {
        CAPTURE(c.text);
        CHECK(error_of(c.text) == c.error);
    }
}

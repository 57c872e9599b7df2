// Whitted's shading against closed forms.
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr double inverse_pi = 0.318309886183790671538;
const double bar = std::is_same_v<Real, double> ? 1e-12 : std::is_same_v<Real, float> ? 3e-5 : 1e-7;

void check_color(const Color &found, double r, double g, double b) {
    CHECK(at(found.x) == doctest::Approx(r).epsilon(bar));
    CHECK(at(found.y) == doctest::Approx(g).epsilon(bar));
    CHECK(at(found.z) == doctest::Approx(b).epsilon(bar));
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a floor has ambient and Lambert's light of every kind") {
    const Double3 color = {0.8, 0.5, 0.2};
    for (const LightKind kind : {LightKind::constant, LightKind::point, LightKind::spot, LightKind::parallel}) {
        Room room;
        Material m = matte(color);
        m.ambient = {0.1, 0.2, 0.3};
        add_floor(room, 0, 50, room.material(m));
        room.light(kind, {3, 4, 0}, {0.5, 1, 2}, {-0.6, -0.8, 0});
        room.build();
        // At the origin: 5 from the light, cosine 4/5.
        const double physical = kind == LightKind::constant   ? 0.8
                                : kind == LightKind::parallel ? 0.8 * inverse_pi
                                                              : 0.8 * inverse_pi / 25;
        CAPTURE(int(kind));
        check_color(room.look({1, 7, 2}, {0, 0, 0}), 0.1 + 0.5 * color.x * physical, 0.2 + color.y * physical,
                    0.3 + 2 * color.z * physical);
        CHECK(room.statistics.rays.shadow == 1);
        CHECK(room.statistics.rays.reflected == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": Phong's highlight is around the mirrored light") {
    for (const double shininess : {1.0, 7.0, 200.0}) {
        Room room;
        Material m = mirror(0.5);
        m.shininess = shininess;
        add_floor(room, 0, 50, room.material(m));
        room.depth = 0;
        room.light(LightKind::constant, {3, 4, 0}, {1, 0.5, 0.25});
        room.build();
        CAPTURE(shininess);
        // The light's mirrored direction is (-3, 4, 0) / 5; 10 degrees off it.
        for (const double degrees : {0.0, 10.0, 80.0}) {
            const double turn = degrees * 3.14159265358979 / 180, c = std::cos(turn), s = std::sin(turn);
            const Double3 from = {-3 * c + 4 * s, 4 * c + 3 * s, 0};
            if (from.y <= 0.1) continue;
            const double highlight = 0.5 * std::pow(c, shininess);
            const Color found = room.look(from, {0, 0, 0});
            CHECK(std::fabs(at(found.x) - highlight) < 20 * bar);
            CHECK(std::fabs(at(found.z) - highlight / 4) < 20 * bar);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": what stands between a light and the floor casts a hard shadow, if it is opaque") {
    for (const bool opaque : {true, false}) {
        Room room;
        const uint32_t floor = room.material(matte({1, 1, 1}));
        const uint32_t roof = room.material(opaque ? matte({1, 1, 1}) : glass(1));
        add_floor(room, 0, 50, floor);
        room.add({-1, 2, 1}, {1, 2, 1}, {1, 2, -1}, {-1, 2, -1}, roof);
        room.light(LightKind::constant, {0, 4, 0}, {1, 1, 1});
        room.build();
        // The roof's shadow reaches to 2 on either side.
        for (const double x : {-3.0, -2.01, -1.99, 0.5, 1.99, 2.01}) {
            const bool shadow = opaque && std::fabs(x) < 2;
            CAPTURE(x);
            const double cosine = 4 / std::sqrt(16 + x * x);
            CHECK(at(room.look({x, 0.5, 3}, {x, 0, 0}).x) == doctest::Approx(shadow ? 0 : cosine).epsilon(bar));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a light behind a surface, in its plane or on it adds nothing that is not there") { // E6
    Room room;
    const uint32_t m = room.material(matte({1, 1, 1}));
    add_floor(room, 0, 50, m);
    // Interpolated normals lean towards a light that is below.
    for (Triangle &t : room.triangles)
        for (Double3 &n : t.normal) n = {0.8, 0.6, 0};
    room.light(LightKind::constant, {40, -4, 0}, {1, 1, 1});
    room.light(LightKind::constant, {40, 0, 0}, {1, 1, 1});
    room.build();
    CHECK(at(room.look({0, 3, 3}, {1, 0, 0}).x) == 0);
    CHECK(room.statistics.rays.shadow == 0);
    Room touched;
    add_floor(touched, 0, 50, touched.material(matte({1, 1, 1})));
    touched.light(LightKind::constant, {50, 0, 50}, {1, 1, 1}); // on a corner
    touched.light(LightKind::constant, {0, 0, 0}, {1, 1, 1});   // inside, and just where a ray looks
    touched.light(LightKind::constant, {0, 5, 0}, {1, 1, 1});
    touched.build();
    CHECK(at(touched.look({0, 3, 3}, {0, 0, 0}).x) == doctest::Approx(1).epsilon(bar));
    CHECK(at(touched.look({3, 3, 3}, {3, 0, 0}).x) == doctest::Approx(5 / std::sqrt(34.0)).epsilon(bar));
}

TEST_CASE(WISP_ARITH_NAME ": two mirrors pass light to and fro until it weighs less than a hundredth") {
    for (const uint32_t depth : {0u, 3u, 20u}) {
        Room room;
        Material m = mirror(0.5);
        m.ambient = {0.25, 0.25, 0.25};
        const uint32_t half = room.material(m);
        room.add({-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0}, half);
        room.add({-50, -50, 1}, {-50, 50, 1}, {50, 50, 1}, {50, -50, 1}, half);
        room.depth = depth;
        room.build();
        const uint32_t chain = std::min(depth, 6u); // 1/64 is the last above a hundredth
        double sum = 0;
        for (uint32_t i = 0; i <= chain; ++i) sum += 0.25 / (1 << i);
        check_color(room.look({0, 0, 0.5}, {0.3, 0.1, 0}), sum, sum, sum);
        CHECK(room.statistics.rays.reflected == chain);
    }
}

TEST_CASE(WISP_ARITH_NAME ": glass bends light as Snell says, and mirrors what cannot leave it") {
    // A slab from z = 0 to z = 1 before a wall whose left half is dark, at z = -2.
    for (const double index : {1.0, 1.5, 2.4})
        for (const double slope : {0.2, 0.8, 1.7}) {
            const double sine = slope / std::sqrt(1 + slope * slope), inside = sine / index;
            const double shift = inside / std::sqrt(1 - inside * inside);
            for (const double side : {-0.01, 0.01}) {
                Room room;
                const uint32_t slab = room.material(glass(index));
                Material bright = matte({0, 0, 0});
                bright.ambient = {1, 1, 1};
                const uint32_t light = room.material(bright), dark = room.material(matte({0, 0, 0}));
                room.add({-50, -50, 1}, {50, -50, 1}, {50, 50, 1}, {-50, 50, 1}, slab);
                room.add({-50, -50, 0}, {-50, 50, 0}, {50, 50, 0}, {50, -50, 0}, slab);
                // The ray enters at x = 0 and meets the wall at shift + 2 slope.
                const double x = shift + 2 * slope + side;
                room.add({x, -50, -2}, {50, -50, -2}, {50, 50, -2}, {x, 50, -2}, light);
                room.add({-50, -50, -2}, {x, -50, -2}, {x, 50, -2}, {-50, 50, -2}, dark);
                room.build();
                CAPTURE(index);
                CAPTURE(slope);
                CAPTURE(side);
                CHECK(at(room.look({-slope, 0.3, 2}, {0, 0.3, 1}).x) == doctest::Approx(side < 0 ? 1 : 0).epsilon(bar));
                CHECK(room.statistics.rays.refracted == 2);
            }
        }
    // From inside, beyond the critical angle of 41.8 degrees: all of it stays inside.
    for (const double slope : {0.88, 0.91}) {
        Room room;
        const uint32_t slab = room.material(glass(1.5));
        room.scene.background = {1, 1, 1};
        room.add({-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0}, slab);
        room.build();
        room.look({-slope, 0.3, -1}, {0, 0.3, 0});
        const bool leaves = slope < 0.9;
        CHECK(room.statistics.rays.refracted == (leaves ? 1 : 0));
        CHECK(room.statistics.rays.reflected == (leaves ? 0 : 1));
    }
}

TEST_CASE(WISP_ARITH_NAME ": a body is where its matrix says, and hidden where it is not visible") {
    // The same occluder as a still triangle of the world, and as a body that is scaled, turned and moved there.
    const Double3 a = {-1, 2, 1}, b = {1, 2.5, 1}, c = {0.5, 2, -1};
    Room still, moved;
    for (Room *room : {&still, &moved}) {
        const uint32_t floor = room->material(matte({1, 1, 1}));
        Material m = matte({0.3, 0.6, 0.9});
        m.ambient = {0.1, 0.1, 0.1};
        room->material(m);
        add_floor(*room, 0, 20, floor);
        room->light(LightKind::point, {0.5, 6, 0.5}, {40, 30, 20});
    }
    still.add(a, b, c, 1);
    // p' = (2 -z, 3 x, y) + (0.5, -1, 2): the way back is p = ((y' + 1) / 3, z' - 2, -(x' - 0.5) / 2).
    const auto back = [](const Double3 &p) { return Double3{(p.y + 1) / 3, p.z - 2, -(p.x - 0.5) / 2}; };
    moved.add(back(a), back(b), back(c), 1);
    moved.scene.static_count = 2;
    moved.scene.instance_triangle_count = 1;
    Instance instance = {
        2, 1, {{0, 3, 0}, {0, 0, 1}, {-2, 0, 0}}, {0.5, -1, 2}, {{0, 0, -0.5}, {1.0 / 3, 0, 0}, {0, 1, 0}}, true};
    moved.instances = {instance};
    still.build();
    moved.build();
    Sequence next{4};
    int seen = 0;
    for (int i = 0; i < 400; ++i) {
        const Double3 from = {next() * 8 - 4, next() * 5 + 3, next() * 8 - 4},
                      to = {next() * 3 - 1.5, 2, next() * 3 - 1.5};
        const Color x = still.look(from, to), y = moved.look(from, to);
        const bool alike = std::fabs(at(x.x - y.x)) < 100 * bar && std::fabs(at(x.z - y.z)) < 100 * bar;
        if (!alike && std::is_same_v<Real, float>)
            continue; // an edge, seen or of the shadow, on the other side of a ray
        CHECK(alike);
        seen += at(x.z) > 0.1 && at(x.x) != at(x.z);
    }
    CHECK(seen > 50);
    moved.instances[0].visible = false;
    moved.build();
    still.triangles.pop_back();
    still.scene.static_count = 2;
    still.build();
    for (int i = 0; i < 100; ++i) {
        const Double3 from = {next() * 8 - 4, next() * 5 + 3, next() * 8 - 4},
                      to = {next() * 3 - 1.5, 2, next() * 3 - 1.5};
        const Color x = still.look(from, to), y = moved.look(from, to);
        CHECK(x == y);
    }
}

TEST_CASE(WISP_ARITH_NAME ": normals of a body are interpolated, however it is scaled") {
    // A triangle of 2 x 2 in the world, of any size in its own space; its normals lean to either side.
    for (const double size : {0x1p11, 0x1p13, 1.0, 0x1p-10}) {
        Room room;
        room.material(matte({1, 1, 1}));
        room.add({-1 / size, -1 / size, 0}, {1 / size, -1 / size, 0}, {0, 1 / size, 0}, 0);
        const Double3 normals[] = {{-0.6, 0, 0.8}, {0.6, 0, 0.8}, {0, 0, 1}};
        std::copy(normals, normals + 3, room.triangles[0].normal);
        room.scene.instance_triangle_count = 1;
        Instance instance = {0, 1, {{size, 0, 0}, {0, size, 0}, {0, 0, size}}, {0, 0, 0}, {}, true};
        instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = 1 / size;
        room.instances = {instance};
        room.light(LightKind::parallel, {0, 0, 0}, {3.14159265358979, 0, 0});
        room.build();
        // At (x, -0.999), of which the last corner has 0.0005.
        for (const double x : {-0.5, 0.0, 0.75}) {
            CAPTURE(size);
            const double z = 0.8 + 0.2 * 0.0005, exact = z / std::sqrt(0.36 * x * x + z * z);
            CHECK(at(room.look({x, -0.999, 3}, {x, -0.999, 0}).x) == doctest::Approx(exact).epsilon(1e-5));
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": where the normals of a triangle cancel, its plane's is taken") {
    // In a triangle of equal sides, whose centre has each normal by a third.
    const double side = 0.866025403784439;
    for (const bool moves : {false, true}) {
        Color seen[2];
        for (const bool cancel : {false, true}) {
            Room room;
            room.material({{0.25, 0.25, 0.25}, {1, 0.5, 1}, {0, 0, 0}, 1, 0, 1});
            room.add({0, 1, 0}, {-side, -0.5, 0}, {side, -0.5, 0}, 0);
            const Double3 normals[] = {{0, 1, 0}, {-side, -0.5, 0}, {side, -0.5, 0}};
            if (cancel) std::copy(normals, normals + 3, room.triangles[0].normal);
            if (moves) {
                room.scene.instance_triangle_count = 1;
                Instance instance = {0, 1, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}, {}, true};
                instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = 1;
                room.instances = {instance};
            }
            room.light(LightKind::parallel, {0, 0, 0}, {3, 2, 1}, {0.6, 0, -0.8});
            room.build();
            seen[cancel] = room.look({0, 0, 3}, {0, 0, 0});
            // Beside it normals are as long as they are, and lie in the plane.
            const Color beside = room.look({0.1, 0, 3}, {0.1, 0, 0});
            CHECK(at(beside.x) == doctest::Approx(cancel ? 0.25 : 0.25 + 3 * 0.8 / pi_).epsilon(1e-4));
        }
        CHECK(seen[0] == seen[1]);
        CHECK(at(seen[0].x) == doctest::Approx(0.25 + 3 * 0.8 / pi_).epsilon(1e-5));
    }
}

TEST_CASE(WISP_ARITH_NAME ": a small body far from the middle has its own planes") {
    // In float the corners of the smaller one fall together in the world.
    for (const double size : {0x1p-10, 0x1p-16}) {
        Room room;
        Material m = matte({0, 0, 0});
        m.diffuse = {1, 1, 1};
        room.material(m);
        room.add({-1, -1, -0.25}, {1, -1, 0.25}, {0, 1, 0}, 0);
        room.scene.instance_triangle_count = 1;
        Instance instance = {0, 1, {{size, 0, 0}, {0, size, 0}, {0, 0, size}}, {2000, 1000, -1500}, {}, true};
        const double back = 1 / size;
        instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = back;
        room.instances = {instance};
        room.light(LightKind::constant, {2000, 1000, 3000}, {1, 1, 1});
        room.build();
        // The normal is (-1, 0, 4), whatever the size.
        const Double3 from = {2000, 1000, -1499};
        CHECK(at(room.look(from, {2000, 1000, -1500}).x) == doctest::Approx(4 / std::sqrt(17.0)).epsilon(1e-4));
    }
}

TEST_CASE(WISP_ARITH_NAME ": a texture is read at its texels, between them, and as a mean where it is far") {
    // 4 x 2 texels: red rises along the row, green is the row; levels 4 x 2, 2 x 1, 1 x 1.
    const auto t = [](double red, double green) {
        return std::vector<uint16_t>{static_cast<uint16_t>(red), static_cast<uint16_t>(green), 0};
    };
    std::vector<uint16_t> texels;
    for (const auto &texel : {t(0, 0), t(10000, 0), t(20000, 0), t(30000, 0), t(0, 60000), t(10000, 60000),
                              t(20000, 60000), t(30000, 60000), t(5000, 30000), t(25000, 30000), t(15000, 30000)})
        texels.insert(texels.end(), texel.begin(), texel.end());
    Room room;
    Material m = matte({0, 0, 0});
    m.ambient = {1, 1, 1};
    room.material(m);
    room.textures = {{4, 2, 3, texels.data()}};
    add_floor(room, 0, 4, 0); // u = 0 to 1 along x from -4 to 4, v = 0 to 1 along z from -4 to 4
    for (Triangle &triangle : room.triangles) {
        triangle.texture = 0;
        for (int i = 0; i < 3; ++i) {
            triangle.texel[i][0] = (triangle.corner[i].x + 4) / 8;
            triangle.texel[i][1] = (triangle.corner[i].z + 4) / 8;
        }
    }
    room.build();
    const auto found = [&room](double x, double z) { return room.look({x, 3, z}, {x, 0, z}); };
    const double red = 10000.0 / 65535, green = 60000.0 / 65535;
    check_color(found(-3, -2), 0, 0, 0); // the middle of texel (0, 0)
    check_color(found(1, 2), 2 * red, green, 0);
    check_color(found(0, 2), 1.5 * red, green, 0); // between (1, 1) and (2, 1)
    check_color(found(1, 0), 2 * red, green / 2, 0);
    check_color(found(-3.999, -2), red * 1.4985, 0, 0); // at the border it goes on with the last column
    // A cone as wide as one texel of level 1 (4 x 4 units), and so wide that all is one texel.
    room.spread = 4;
    room.build();
    check_color(room.look({-2, 1, 0}, {-2, 0, 0}), 0.5 * red, green / 2, 0);
    room.spread = 1000;
    room.build();
    check_color(room.look({-2, 1, 0}, {-2, 0, 0}), 1.5 * red, green / 2, 0);
}

TEST_CASE(WISP_ARITH_NAME ": texels that are long on a surface are averaged along the footprint alone") {
    // Two columns, black and red, and rows whose green rises. Red's mean is its half, wherever a footprint of many
    // columns lies; green is what the row has.
    constexpr int32_t rows = 64;
    std::vector<uint16_t> texels;
    for (int32_t width = 2, height = rows; width > 0;
         width = height > 1 ? 1 : 0, height /= 2) // levels down to one texel
        for (int32_t row = 0; row < height; ++row)
            for (int32_t column = 0; column < width; ++column) {
                texels.push_back(static_cast<uint16_t>(width == 1 ? 30000 : 60000 * column));
                texels.push_back(static_cast<uint16_t>(60000 * (row + 0.5) / height));
                texels.push_back(0);
            }
    for (const double turn : {0.0, 0.3}) {          // of the columns over the floor
        for (const double columns : {100.0, 1e4}) { // in a unit of length
            Room room;
            Material m = matte({0, 0, 0});
            m.ambient = {1, 1, 1};
            room.material(m);
            room.textures = {{2, rows, 7, texels.data()}};
            add_floor(room, 0, 4, 0);
            for (Triangle &triangle : room.triangles) {
                triangle.texture = 0;
                for (int i = 0; i < 3; ++i) {
                    const double x = triangle.corner[i].x, z = triangle.corner[i].z;
                    triangle.texel[i][0] = (std::cos(turn) * x + std::sin(turn) * z) * columns / 2;
                    triangle.texel[i][1] = (std::cos(turn) * z - std::sin(turn) * x + 6) / 12;
                }
            }
            room.spread = 5.3 / columns; // a pixel sees 5.3 columns
            room.build();
            for (int i = 0; i < 50; ++i) {
                const double x = -2 + 0.0771 * i, z = -1 + 0.0337 * i;
                const double row = (std::cos(turn) * z - std::sin(turn) * x + 6) / 12 * rows;
                const Color found = room.look({x, 1, z}, {x, 0, z});
                CAPTURE(i);
                CHECK(at(found.x) * 65535 ==
                      doctest::Approx(30000).epsilon(0.09)); // the mean over 5.3 columns: within 8.6 %
                CHECK(at(found.y) * 65535 == doctest::Approx(60000 * row / rows).epsilon(1e-3));
            }
        }
    }
}

} // namespace wisp::WISP_ARITH

// The tree of boxes beside the kd-tree and Embree 3, one ray at a time on one thread: primary rays, shadow rays,
// bounces.
//
//   rays SCENE...       camera rays of the first frame of a scene (NFF, AFF) at 512 x 512; `room` is a made-up scene of
//                       about 140,000 triangles
//
// Every triangle is in one tree, in the world's space. Embree runs with RTC_SCENE_FLAG_ROBUST, once with the widest
// vectors of the machine and once as isa=sse2, which is the fair comparison for bits that do not depend on the machine.
// Embree's scene for shadow rays holds opaque triangles only. Times are medians of five alternating runs; `ratio` is a
// rival's time over ours. Hits are compared before anything is timed.
#include "core/numbers/random.h"
#include "embree.h"

namespace wisp::WISP_ARITH {
namespace {

double unit(Mt19937 &random) { return random() * 0x1p-32; }

// ---- scenes ----

Triangle triangle_of(const Double3 &a, const Double3 &b, const Double3 &c) {
    Triangle triangle = {};
    triangle.corner[0] = a, triangle.corner[1] = b, triangle.corner[2] = c;
    triangle.texture = -1;
    return triangle;
}

void add_rectangle(Triangles &all, const Double3 &p, const Double3 &u, const Double3 &v) {
    const Double3 b = {p.x + u.x, p.y + u.y, p.z + u.z}, d = {p.x + v.x, p.y + v.y, p.z + v.z};
    const Double3 c = {b.x + v.x, b.y + v.y, b.z + v.z};
    all.push_back(triangle_of(p, b, c));
    all.push_back(triangle_of(p, c, d));
}

void add_box(Triangles &all, const Double3 &low, const Double3 &size) {
    const Double3 x = {size.x, 0, 0}, y = {0, size.y, 0}, z = {0, 0, size.z};
    const Double3 high = {low.x + size.x, low.y + size.y, low.z + size.z};
    const auto back = [](const Double3 &v) { return Double3{-v.x, -v.y, -v.z}; };
    add_rectangle(all, low, x, y), add_rectangle(all, low, y, z), add_rectangle(all, low, z, x);
    add_rectangle(all, high, back(x), back(y)), add_rectangle(all, high, back(y), back(z));
    add_rectangle(all, high, back(z), back(x));
}

void add_ball(Triangles &all, const Double3 &center, double radius, int rings) {
    const auto at = [&](int i, int j) {
        const double pi = 3.14159265358979323846, a = pi * i / rings, b = pi * j / rings;
        return Double3{center.x + radius * std::sin(a) * std::cos(b), center.y + radius * std::sin(a) * std::sin(b),
                       center.z + radius * std::cos(a)};
    };
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < 2 * rings; ++j) {
            if (i > 0) all.push_back(triangle_of(at(i, j), at(i, j + 1), at(i + 1, j)));
            if (i + 1 < rings) all.push_back(triangle_of(at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)));
        }
}

// A room with furniture: tables and shelves of boxes, and bowls and fruit upon them, small and in heaps.
FlatScene room() {
    Mt19937 random(5, 0, 0, 0);
    Triangles all;
    add_box(all, {-5, -4, 0}, {10, 8, 3});
    for (int table = 0; table < 14; ++table) {
        const double x = -4.5 + 8 * unit(random), y = -3.5 + 6 * unit(random), height = 0.4 + 0.8 * unit(random);
        add_box(all, {x, y, height}, {1, 0.7, 0.04});
        for (int leg = 0; leg < 4; ++leg)
            add_box(all, {x + (leg & 1 ? 0.94 : 0), y + (leg & 2 ? 0.64 : 0), 0}, {0.06, 0.06, height});
        for (int thing = 0; thing < 22; ++thing) {
            const double tx = x + unit(random), ty = y + 0.7 * unit(random), size = 0.01 + 0.09 * unit(random);
            if (thing % 3 == 0)
                add_box(all, {tx, ty, height + 0.04}, {size, 2 * size * unit(random), size});
            else
                add_ball(all, {tx, ty, height + 0.04 + size}, size, 8 + static_cast<int>(12 * unit(random)));
        }
    }
    // To (0.5, 0.4, 0.9), 1.4 wide and high at a distance of 1.
    const Double3 eye = {-4.4, -3.36, 1.86}, corner = {0.444, 1.222, 0.538}, right = {0.851, -1.112, 0},
                  down = {-0.171, -0.131, -1.383};
    const auto over = [](const Double3 &v, double by) { return Double3{v.x / by, v.y / by, v.z / by}; };
    return {all,
            {Material{}},
            {eye, corner, over(right, pixels), over(down, pixels)},
            {{0, 0, 2.79}, {-3, 2.4, 2.4}, {3.5, -1.6, 2.1}},
            1e-4};
}

FlatScene read_flat(const std::string &name) {
    Options options;
    options.width = options.height = pixels;
    PreparedScene prepared;
    prepare_scene(name, read_scene(name), options, 0, prepared);
    return flatten(prepared.scene);
}

// ---- rays ----

struct Rays {
    std::string name;
    bool any;
    std::vector<Query> queries;
};

class Wisp {
  public:
    Wisp(const FlatScene &flat, TreeKind kind)
        : memory_(triangle_tree_bytes(kind, static_cast<uint32_t>(flat.triangles.size()))),
          begin_(to_real<Real>(flat.ray_epsilon)) {
        Arena arena(memory_.data(), memory_.size());
        const double start = now();
        tree = make_triangle_tree(kind, flat.triangles.data(), static_cast<uint32_t>(flat.triangles.size()),
                                  flat.materials.data(), arena);
        build_seconds = now() - start;
        bytes = arena.mark();
        if (!tree.ready) std::exit(1);
    }
    bool closest(const Query &query, SurfaceHit &hit) const {
        return nearest_hit(tree, TriangleRay(query.origin, query.direction), begin_, query.end, query.ignore_triangle,
                           hit, counts);
    }
    bool occluded(const Query &query) const {
        uint32_t occluder = 0;
        return any_hit(tree, TriangleRay(query.origin, query.direction), begin_, query.end, query.ignore_triangle,
                       occluder, counts);
    }
    TriangleTree tree;
    double build_seconds;
    size_t bytes;
    mutable TreeCounts counts = {0, 0};

  private:
    std::vector<unsigned char> memory_;
    Real begin_;
};

// Embree's scene of all triangles for closest hits, and its scene of opaque triangles for shadow rays.
class Rival {
  public:
    Rival(const FlatScene &flat, const char *options)
        : all(flat.triangles, flat.ray_epsilon, options), opaque_(opaque(flat), flat.ray_epsilon, options) {}
    bool closest(const Query &query, float &distance) const { return all.closest(query, distance); }
    bool occluded(const Query &query) const { return opaque_.occluded(query); }
    Embree all;

  private:
    Embree opaque_;
};

template <class Hit, class Tracer> uint64_t trace(const Tracer &tracer, const Rays &rays) {
    uint64_t hits = 0;
    Hit hit;
    if (rays.any)
        for (const Query &query : rays.queries) hits += tracer.occluded(query) ? 1 : 0;
    else
        for (const Query &query : rays.queries) hits += tracer.closest(query, hit) ? 1 : 0;
    return hits;
}

std::vector<Rays> make_rays(const Wisp &wisp, const FlatScene &flat) {
    const Real far = infinite_distance, ray_epsilon = to_real<Real>(flat.ray_epsilon);
    Rays primary = {"primary", false, {}}, shadow = {"shadow", true, {}}, mirrored = {"mirrored", false, {}},
         diffuse = {"diffuse", false, {}};
    Mt19937 random(3, 0, 0, 0);
    const View view(flat.camera);
    for (int i = 0; i < pixels * pixels; ++i) {
        const Ray ray = view.ray_through(Real(i % pixels) + Real(0.5), Real(i / pixels) + Real(0.5));
        const Query query = {ray.origin, ray.direction, far, no_triangle};
        primary.queries.push_back(query);
        SurfaceHit hit;
        if (!wisp.closest(query, hit)) continue;
        const Triangle &triangle = flat.triangles[hit.triangle];
        const Vec3 a = vec_of(triangle.corner[0]), b = vec_of(triangle.corner[1]), c = vec_of(triangle.corner[2]);
        Vec3 normal = normalize(cross(normalize(b - a), normalize(c - a)));
        if (dot(normal, query.direction) > Real(0)) normal = -normal;
        const Vec3 at = query.origin + query.direction * hit.distance;
        for (const Double3 &light : flat.lights) {
            const Vec3 way = vec_of(light) - at;
            if (!(dot(way, normal) > Real(0))) continue;
            const Real distance = length(way);
            shadow.queries.push_back({at, way / distance, distance - ray_epsilon, hit.triangle});
        }
        mirrored.queries.push_back(
            {at, normalize(query.direction - normal * (Real(2) * dot(normal, query.direction))), far, hit.triangle});
        for (;;) {
            const double x = 2 * unit(random) - 1, y = 2 * unit(random) - 1, z = 2 * unit(random) - 1;
            const Vec3 d = vec_of({x, y, z});
            if (dot(d, d) > Real(1) || dot(d, d) < Real(0.01) || !(dot(d, normal) > Real(0))) continue;
            diffuse.queries.push_back({at, normalize(d), far, hit.triangle});
            break;
        }
    }
    return {primary, shadow, mirrored, diffuse};
}

// How many rays Embree answers differently: rays that hit edges, or coplanar triangles, or triangles near the ray's
// begin.
uint32_t differences(const Wisp &wisp, const Rival &rival, const Rays &rays) {
    uint32_t different = 0;
    for (const Query &query : rays.queries) {
        if (rays.any) {
            different += wisp.occluded(query) != rival.occluded(query) ? 1 : 0;
            continue;
        }
        SurfaceHit ours;
        float theirs;
        const bool hit = wisp.closest(query, ours);
        const bool same = hit == rival.closest(query, theirs) &&
                          (!hit || std::abs(to_double(ours.distance) - theirs) <= 1e-4 * (1 + theirs));
        different += same ? 0 : 1;
    }
    return different;
}

void measure(const std::string &name, const FlatScene &flat) {
    const Wisp wisp(flat, TreeKind::bvh), kd(flat, TreeKind::kd);
    const Rival wide(flat, "threads=1,set_affinity=0"), sse2(flat, "threads=1,isa=sse2,set_affinity=0");
    const double count = static_cast<double>(flat.triangles.size());
    std::printf(WISP_ARITH_NAME ",%s,%zu triangles,build s,wisp,%.3g,,,\n", name.c_str(), flat.triangles.size(),
                wisp.build_seconds);
    std::printf(WISP_ARITH_NAME ",%s,,build s,kd-tree,%.3g,%.2f,,\n", name.c_str(), kd.build_seconds,
                kd.build_seconds / wisp.build_seconds);
    std::printf(WISP_ARITH_NAME ",%s,,build s,Embree,%.3g,%.2f,,\n", name.c_str(), wide.all.build_seconds,
                wide.all.build_seconds / wisp.build_seconds);
    std::printf(WISP_ARITH_NAME ",%s,,bytes a triangle,wisp,%.4g,,%u nodes,%u groups\n", name.c_str(),
                static_cast<double>(wisp.bytes) / count, wisp.tree.node_count, wisp.tree.group_count);
    std::printf(WISP_ARITH_NAME ",%s,,bytes a triangle,kd-tree,%.4g,%.2f,%u nodes,%u groups\n", name.c_str(),
                static_cast<double>(kd.bytes) / count, static_cast<double>(kd.bytes) / static_cast<double>(wisp.bytes),
                kd.tree.node_count, kd.tree.group_count);
    std::printf(WISP_ARITH_NAME ",%s,,bytes a triangle,Embree,%.4g,%.2f,,\n", name.c_str(),
                static_cast<double>(wide.all.bytes) / count,
                static_cast<double>(wide.all.bytes) / static_cast<double>(wisp.bytes));
    for (const Rays &rays : make_rays(wisp, flat)) {
        const double ray_count = static_cast<double>(rays.queries.size());
        const uint32_t different = differences(wisp, sse2, rays);
        if (different > rays.queries.size() / 100) {
            std::fprintf(stderr, "%s: %s: %u hits differ\n", name.c_str(), rays.name.c_str(), different);
            std::exit(1);
        }
        double visits[2], tests[2];
        for (const Wisp *tree : {&wisp, &kd}) {
            tree->counts = {0, 0};
            trace<SurfaceHit>(*tree, rays);
            visits[tree == &kd] = static_cast<double>(tree->counts.node_visits) / ray_count;
            tests[tree == &kd] = static_cast<double>(tree->counts.triangle_tests) / ray_count;
        }
        std::vector<double> seconds[4];
        volatile uint64_t sink = 0;
        for (int run = 0; run < 5; ++run) {
            double start = now();
            sink = trace<SurfaceHit>(wisp, rays);
            seconds[0].push_back(now() - start), start = now();
            sink = trace<float>(sse2, rays);
            seconds[1].push_back(now() - start), start = now();
            sink = trace<float>(wide, rays);
            seconds[2].push_back(now() - start), start = now();
            sink = trace<SurfaceHit>(kd, rays);
            seconds[3].push_back(now() - start);
        }
        (void)sink;
        for (std::vector<double> &s : seconds) std::sort(s.begin(), s.end());
        std::printf(WISP_ARITH_NAME ",%s,%s,Mrays/s,wisp,%.3g,,%.1f visits,%.1f tests\n", name.c_str(),
                    rays.name.c_str(), ray_count / seconds[0][2] * 1e-6, visits[0], tests[0]);
        std::printf(WISP_ARITH_NAME ",%s,%s,Mrays/s,kd-tree,%.3g,%.2f,%.1f visits,%.1f tests\n", name.c_str(),
                    rays.name.c_str(), ray_count / seconds[3][2] * 1e-6, seconds[3][2] / seconds[0][2], visits[1],
                    tests[1]);
        std::printf(WISP_ARITH_NAME ",%s,%s,Mrays/s,Embree sse2,%.3g,%.2f,%u differ,\n", name.c_str(),
                    rays.name.c_str(), ray_count / seconds[1][2] * 1e-6, seconds[1][2] / seconds[0][2], different);
        std::printf(WISP_ARITH_NAME ",%s,%s,Mrays/s,Embree,%.3g,%.2f,,\n", name.c_str(), rays.name.c_str(),
                    ray_count / seconds[2][2] * 1e-6, seconds[2][2] / seconds[0][2]);
        std::fflush(stdout);
    }
}

} // namespace
} // namespace wisp::WISP_ARITH

int main(int count, char **words) {
    using namespace wisp;
    using namespace wisp::WISP_ARITH;
    std::printf("arithmetic,scene,rays,what,who,value,ratio,visits,tests\n");
    try {
        for (int i = 1; i < count; ++i) {
            const std::string name = words[i];
            measure(name.substr(name.rfind('/') + 1), name == "room" ? room() : read_flat(name));
        }
    } catch (const Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}

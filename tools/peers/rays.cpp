// The triangle tree beside Embree 3, one ray at a time on one thread: primary rays, shadow rays, bounces.
//
//   rays [FILE...]      each FILE holds triangles: their number as uint32, then nine float32 each, little-endian;
//                       without any, the scene is a made-up room of about 100,000 triangles
//
// Embree is asked for RTC_SCENE_FLAG_ROBUST, once with the widest vectors of the machine and once as isa=sse2, which is
// what bits that do not depend on the machine are held against. Times are medians of five alternating runs; `ratio` is
// a rival's time over ours. Hits are compared before anything is timed.
#include "wisp/random.h"
#include "wisp/triangle_tree.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <embree3/rtcore.h>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace wisp::f32 {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double unit(Mt19937 &random) { return random() * 0x1p-32; }

// ---- scenes ----

using Triangles = std::vector<Triangle>;

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
Triangles room() {
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
    return all;
}

Triangles read_triangles(const char *name) {
    std::FILE *file = std::fopen(name, "rb");
    uint32_t count = 0;
    Triangles all;
    float x[9];
    if (file && std::fread(&count, sizeof count, 1, file) == 1)
        while (all.size() < count && std::fread(x, sizeof x, 1, file) == 1)
            all.push_back(triangle_of({x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], x[8]}));
    if (file) std::fclose(file);
    if (!file || all.size() != count || count == 0) {
        std::fprintf(stderr, "%s: expected the number of triangles and nine floats each\n", name);
        std::exit(1);
    }
    return all;
}

// ---- rays ----

struct Query {
    Vec3 origin, direction;
    float end;
    uint32_t skip; // of wisp; Embree begins at `begin` instead
};
constexpr float begin = 1e-4f;

struct Rays {
    std::string name;
    bool any;
    std::vector<Query> queries;
};

class Wisp {
  public:
    explicit Wisp(const Triangles &triangles) : memory_(triangle_tree_bytes(static_cast<uint32_t>(triangles.size()))) {
        Arena arena(memory_.data(), memory_.size());
        const double start = now();
        tree = make_triangle_tree(triangles.data(), static_cast<uint32_t>(triangles.size()), &material_, arena);
        build_seconds = now() - start;
        bytes = arena.mark();
        if (!tree.ready) std::exit(1);
    }
    bool closest(const Query &query, SurfaceHit &hit) const {
        return nearest_hit(tree, TriangleRay(query.origin, query.direction), begin, query.end, query.skip, hit, counts);
    }
    bool occluded(const Query &query) const {
        uint32_t occluder = 0;
        return any_hit(tree, TriangleRay(query.origin, query.direction), begin, query.end, query.skip, occluder,
                       counts);
    }
    TriangleTree tree;
    double build_seconds;
    size_t bytes;
    mutable TreeCounts counts = {0, 0};

  private:
    std::vector<unsigned char> memory_;
    Material material_ = {};
};

class Embree {
  public:
    Embree(const Triangles &triangles, const char *options) : device_(rtcNewDevice(options)) {
        rtcSetDeviceMemoryMonitorFunction(
            device_,
            [](void *sum, ssize_t change, bool) {
                *static_cast<ssize_t *>(sum) += change;
                return true;
            },
            &bytes);
        const double start = now();
        scene_ = rtcNewScene(device_);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        const size_t count = triangles.size();
        float *corners = static_cast<float *>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                      RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count));
        uint32_t *indices = static_cast<uint32_t *>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), count));
        for (size_t i = 0; i < 3 * count; ++i) {
            const Vec3 p = vec_of(triangles[i / 3].corner[i % 3]);
            for (int a = 0; a < 3; ++a) corners[3 * i + static_cast<size_t>(a)] = p[a];
            indices[i] = static_cast<uint32_t>(i);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
        build_seconds = now() - start;
    }
    ~Embree() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    bool closest(const Query &query, SurfaceHit &hit) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit asked = {};
        asked.ray = ray_of(query);
        asked.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context, &asked);
        hit = {asked.ray.tfar, asked.hit.primID, asked.hit.u, asked.hit.v};
        return asked.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    bool occluded(const Query &query) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRay ray = ray_of(query);
        rtcOccluded1(scene_, &context, &ray);
        return ray.tfar < 0;
    }
    double build_seconds;
    ssize_t bytes = 0;

  private:
    static RTCRay ray_of(const Query &query) {
        RTCRay ray = {};
        ray.org_x = query.origin.x, ray.org_y = query.origin.y, ray.org_z = query.origin.z;
        ray.dir_x = query.direction.x, ray.dir_y = query.direction.y, ray.dir_z = query.direction.z;
        ray.tnear = begin, ray.tfar = query.end;
        ray.mask = 0xffffffff;
        return ray;
    }
    RTCDevice device_;
    RTCScene scene_;
};

template <class Tracer> uint64_t trace(const Tracer &tracer, const Rays &rays) {
    uint64_t hits = 0;
    SurfaceHit hit;
    if (rays.any)
        for (const Query &query : rays.queries) hits += tracer.occluded(query) ? 1 : 0;
    else
        for (const Query &query : rays.queries) hits += tracer.closest(query, hit) ? 1 : 0;
    return hits;
}

std::vector<Rays> make_rays(const Wisp &wisp, const Triangles &triangles) {
    constexpr int size = 512;
    constexpr float far = 1e6f;
    Rays primary = {"primary", false, {}}, shadow = {"shadow", true, {}}, mirrored = {"mirrored", false, {}},
         diffuse = {"diffuse", false, {}};
    Mt19937 random(3, 0, 0, 0);
    const Box &box = wisp.tree.bounds;
    const Vec3 extent = box.high - box.low;
    const auto inside = [&](float x, float y, float z) { return box.low + Vec3(x, y, z) * extent; };
    const Vec3 eye = inside(0.06f, 0.08f, 0.62f),
               lights[3] = {inside(0.5f, 0.5f, 0.93f), inside(0.2f, 0.8f, 0.8f), inside(0.85f, 0.3f, 0.7f)};
    const Vec3 forward = normalize(inside(0.55f, 0.55f, 0.3f) - eye);
    const Vec3 right = normalize(glm::cross(forward, Vec3(0, 0, 1))), down = glm::cross(forward, right);
    for (int i = 0; i < size * size; ++i) {
        const float x = (static_cast<float>(i % size) + 0.5f) / size - 0.5f,
                    y = (static_cast<float>(i / size) + 0.5f) / size - 0.5f;
        const Query query = {eye, normalize(forward + right * (1.4f * x) + down * (1.4f * y)), far, no_triangle};
        primary.queries.push_back(query);
        SurfaceHit hit;
        if (!wisp.closest(query, hit)) continue;
        const Triangle &triangle = triangles[hit.triangle];
        const Vec3 a = vec_of(triangle.corner[0]), b = vec_of(triangle.corner[1]), c = vec_of(triangle.corner[2]);
        Vec3 normal = normalize(glm::cross(b - a, c - a));
        if (dot(normal, query.direction) > 0) normal = -normal;
        const Vec3 at = query.origin + query.direction * hit.distance;
        for (const Vec3 &light : lights) {
            if (dot(light - at, normal) <= 0) continue;
            const float distance = length(light - at);
            shadow.queries.push_back({at, (light - at) / distance, distance * (1 - 1e-4f), hit.triangle});
        }
        mirrored.queries.push_back(
            {at, normalize(query.direction - normal * (2 * dot(normal, query.direction))), far, hit.triangle});
        for (;;) {
            const float dx = static_cast<float>(2 * unit(random) - 1), dy = static_cast<float>(2 * unit(random) - 1),
                        dz = static_cast<float>(2 * unit(random) - 1);
            const Vec3 d(dx, dy, dz);
            if (dot(d, d) > 1 || dot(d, d) < 0.01f || dot(d, normal) <= 0) continue;
            diffuse.queries.push_back({at, normalize(d), far, hit.triangle});
            break;
        }
    }
    return {primary, shadow, mirrored, diffuse};
}

// How many of the rays Embree sees otherwise: at edges and where triangles lie in one plane, or near `begin`.
uint32_t differences(const Wisp &wisp, const Embree &embree, const Rays &rays) {
    uint32_t different = 0;
    for (const Query &query : rays.queries) {
        if (rays.any) {
            different += wisp.occluded(query) != embree.occluded(query) ? 1 : 0;
            continue;
        }
        SurfaceHit ours, theirs;
        const bool hit = wisp.closest(query, ours);
        const bool same = hit == embree.closest(query, theirs) &&
                          (!hit || std::abs(ours.distance - theirs.distance) <= 1e-4f * (1 + theirs.distance));
        different += same ? 0 : 1;
    }
    return different;
}

void measure(const std::string &name, const Triangles &triangles) {
    const Wisp wisp(triangles);
    const Embree wide(triangles, "threads=1,set_affinity=0"), sse2(triangles, "threads=1,isa=sse2,set_affinity=0");
    const double count = static_cast<double>(triangles.size());
    std::printf("%s,%zu triangles,build s,wisp,%.3g,,,\n", name.c_str(), triangles.size(), wisp.build_seconds);
    std::printf("%s,,build s,Embree,%.3g,%.2f,,\n", name.c_str(), wide.build_seconds,
                wide.build_seconds / wisp.build_seconds);
    std::printf("%s,,bytes a triangle,wisp,%.4g,,%u nodes,%u groups\n", name.c_str(),
                static_cast<double>(wisp.bytes) / count, wisp.tree.node_count, wisp.tree.group_count);
    std::printf("%s,,bytes a triangle,Embree,%.4g,%.2f,,\n", name.c_str(), static_cast<double>(wide.bytes) / count,
                static_cast<double>(wide.bytes) / static_cast<double>(wisp.bytes));
    for (const Rays &rays : make_rays(wisp, triangles)) {
        const double asked = static_cast<double>(rays.queries.size());
        const uint32_t different = differences(wisp, sse2, rays);
        if (different > rays.queries.size() / 100) {
            std::fprintf(stderr, "%s: %s: %u hits differ\n", name.c_str(), rays.name.c_str(), different);
            std::exit(1);
        }
        wisp.counts = {0, 0};
        trace(wisp, rays);
        const double visits = static_cast<double>(wisp.counts.node_visits) / asked;
        const double tests = static_cast<double>(wisp.counts.triangle_tests) / asked;
        std::vector<double> seconds[3];
        volatile uint64_t sink = 0;
        for (int run = 0; run < 5; ++run) {
            double start = now();
            sink = trace(wisp, rays);
            seconds[0].push_back(now() - start), start = now();
            sink = trace(sse2, rays);
            seconds[1].push_back(now() - start), start = now();
            sink = trace(wide, rays);
            seconds[2].push_back(now() - start);
        }
        (void)sink;
        for (std::vector<double> &s : seconds) std::sort(s.begin(), s.end());
        std::printf("%s,%s,Mrays/s,wisp,%.3g,,%.1f visits,%.1f tests\n", name.c_str(), rays.name.c_str(),
                    asked / seconds[0][2] * 1e-6, visits, tests);
        std::printf("%s,%s,Mrays/s,Embree sse2,%.3g,%.2f,%u differ,\n", name.c_str(), rays.name.c_str(),
                    asked / seconds[1][2] * 1e-6, seconds[1][2] / seconds[0][2], different);
        std::printf("%s,%s,Mrays/s,Embree,%.3g,%.2f,,\n", name.c_str(), rays.name.c_str(), asked / seconds[2][2] * 1e-6,
                    seconds[2][2] / seconds[0][2]);
        std::fflush(stdout);
    }
}

} // namespace
} // namespace wisp::f32

int main(int count, char **words) {
    using namespace wisp::f32;
    std::printf("scene,rays,what,who,value,ratio,visits,tests\n");
    for (int i = 1; i < count; ++i) {
        const std::string name = words[i];
        measure(name.substr(name.rfind('/') + 1), read_triangles(words[i]));
    }
    if (count == 1) measure("room", room());
}

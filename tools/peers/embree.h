// Embree 3 beside wisp's trees: scenes as both take them, and rays through it.
#pragma once
#include "core/geometry/camera.h"
#include "core/surfaces/triangle_queries.h"
#include "host/base/error.h"
#include "host/prepare/prepare.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <embree3/rtcore.h>
#include <string>
#include <vector>

namespace wisp::WISP_ARITH {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

using Triangles = std::vector<Triangle>;

// All triangles of a frame in the world's space, without instances, and what the rays are made from.
struct FlatScene {
    Triangles triangles;
    std::vector<Material> materials;
    Camera camera; // of a picture of `pixels` x `pixels`
    std::vector<Double3> lights;
    double ray_epsilon;
};
constexpr int pixels = 512;

// From the space of the instance to the world's.
Double3 to_world(const Instance &instance, const Double3 &p) {
    const Double3 *axis = instance.axis;
    return {axis[0].x * p.x + axis[1].x * p.y + axis[2].x * p.z + instance.origin.x,
            axis[0].y * p.x + axis[1].y * p.y + axis[2].y * p.z + instance.origin.y,
            axis[0].z * p.x + axis[1].z * p.y + axis[2].z * p.z + instance.origin.z};
}

FlatScene flatten(const Scene &scene) {
    FlatScene flat = {
        {}, {scene.materials, scene.materials + scene.material_count}, scene.camera, {}, scene.ray_epsilon};
    const auto add = [&](uint32_t first, uint32_t count, const Instance *instance) {
        for (uint32_t i = first; i < first + count; ++i) {
            flat.triangles.push_back(scene.triangles[i]);
            if (instance)
                for (Double3 &corner : flat.triangles.back().corner) corner = to_world(*instance, corner);
        }
    };
    add(0, scene.static_count, nullptr);
    for (uint32_t i = 0; i < scene.instance_count; ++i)
        if (scene.instances[i].visible) add(scene.instances[i].first, scene.instances[i].count, &scene.instances[i]);
    add(scene.static_count + scene.instance_triangle_count, scene.deforming_count, nullptr);
    for (uint32_t i = 0; i < scene.light_count; ++i)
        if (scene.lights[i].kind != LightKind::parallel) flat.lights.push_back(scene.lights[i].position);
    return flat;
}

[[maybe_unused]] Triangles opaque(const FlatScene &flat) {
    Triangles triangles;
    for (const Triangle &triangle : flat.triangles)
        if (!(flat.materials[triangle.material].transmission > 0)) triangles.push_back(triangle);
    return triangles;
}

struct Query {
    Vec3 origin, direction;
    Real end;
    uint32_t ignore_triangle; // for wisp only
};

class Embree {
  public:
    Embree(const Triangles &triangles, double ray_epsilon, const char *options)
        : device_(rtcNewDevice(options)), begin_(static_cast<float>(ray_epsilon)) {
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
            const Double3 &p = triangles[i / 3].corner[i % 3];
            corners[3 * i] = static_cast<float>(p.x);
            corners[3 * i + 1] = static_cast<float>(p.y);
            corners[3 * i + 2] = static_cast<float>(p.z);
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
    bool closest(const Query &query, float &distance) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit result = {};
        result.ray = ray_of(query);
        result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_, &context, &result);
        distance = result.ray.tfar;
        return result.hit.geomID != RTC_INVALID_GEOMETRY_ID;
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
    RTCRay ray_of(const Query &query) const {
        const auto single = [](Real x) { return static_cast<float>(to_double(x)); };
        RTCRay ray = {};
        ray.org_x = single(query.origin.x), ray.org_y = single(query.origin.y), ray.org_z = single(query.origin.z);
        ray.dir_x = single(query.direction.x), ray.dir_y = single(query.direction.y);
        ray.dir_z = single(query.direction.z);
        ray.tnear = begin_, ray.tfar = single(query.end);
        ray.mask = 0xffffffff;
        return ray;
    }
    RTCDevice device_;
    RTCScene scene_;
    float begin_;
};

} // namespace
} // namespace wisp::WISP_ARITH

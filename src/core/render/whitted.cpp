// Whitted's recursive ray tracing.
#include "core/numbers/double_bits.h"
#include "core/render/whitted.h"
#include "core/surfaces/texture.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr Real min_ray_weight = Real(0.01); // in its pixel: a ray of less weight is not traced

constexpr uint32_t units_of_ray = 256, units_of_light = 16; // of work

// A ray and the cone of what its pixel sees by it.
struct Beam {
    Ray ray;
    Real width;               // of the cone at the ray's origin
    uint32_t ignore_triangle; // the ray starts on it
};

enum : uint32_t { reflected, refracted }; // of a level's rays that go on

// A point of a surface, with its normals on the side of the ray that hit it.
struct Point {
    Vec3 position;
    Vec3 plane;   // the triangle's normal, on the ray's side
    Vec3 normal;  // the interpolated one, on the same side of the plane as `plane`
    bool entered; // the ray came from outside
    const SurfaceMaterial *material;
    Color texture;
    uint32_t triangle;
    bool is_static; // the triangle never moves
    Real u, v;      // in the triangle
    uint32_t instance;
    Real width; // of the cone
};

Vec3 applied(const Vec3 axis[3], const Vec3 &v) { return axis[0] * v.x + axis[1] * v.y + axis[2] * v.z; }
Real binary_log(Real x) { return log(x) * Real(1.44269504088896340736); }
Vec3 mirrored(const Vec3 &direction, const Vec3 &normal) {
    return direction - normal * (Real(2) * dot(direction, normal));
}

// A triangle's edges as unit vectors times about 1, their sizes, and the sine between the vectors times their lengths:
// in fixed point, the product of short edges has no digits left.
struct Sides {
    Vec3 first, second;
    Real size1, size2, sine;
};

// What a circle on a triangle is among its texels: an ellipse. With T the texels along the edges, as columns, and E the
// edges' products, the squares of its axes are the eigenvalues of T E^-1 T^t. Here they are times the square of `sine`,
// which is det E. T is in parts of the texture's longer side times `pictures`, the most that an edge changes u or v by,
// along a length of the shorter edge.
struct TexelEllipse {
    Real half, across; // half of the difference of the matrix's entries on the diagonal, and the other entry
    Real root, longer; // half of the difference of the eigenvalues, and the greater one
    Real ratio;        // of the longer axis to the shorter one
};
TexelEllipse texel_ellipse(const Sides &sides, Real u1, Real v1, Real u2, Real v2, Real pictures,
                           const Texture &texture) {
    const int32_t side = max(texture.width, texture.height);
    const Real width = Real(texture.width) / Real(side), height = Real(texture.height) / Real(side);
    const Real size = min(sides.size1, sides.size2), of_first = size / sides.size1, of_second = size / sides.size2;
    const Real a1 = u1 / pictures * width * of_first, b1 = v1 / pictures * height * of_first,
               a2 = u2 / pictures * width * of_second, b2 = v2 / pictures * height * of_second;
    const Real e = dot(sides.first, sides.first), f = dot(sides.first, sides.second),
               g = dot(sides.second, sides.second);
    const Real uu = g * a1 * a1 - Real(2) * f * a1 * a2 + e * a2 * a2,
               uv = g * a1 * b1 - f * (a1 * b2 + a2 * b1) + e * a2 * b2,
               vv = g * b1 * b1 - Real(2) * f * b1 * b2 + e * b2 * b2;
    const Real half = (uu - vv) * Real(0.5), root = sqrt(half * half + uv * uv), longer = (uu + vv) * Real(0.5) + root;
    const Real shorter = abs(a1 * b2 - a2 * b1) * sides.sine; // times the longer one: the root of the determinant
    return {half, uv, root, longer, longer > Real(0) ? bounded_quotient(longer, shorter) : Real(1)};
}

// The mean of the triangle's texture in the beam's footprint: as wide as the cone, and longer the more it is slanted.
// Where texels are more than twice as long as wide on the triangle, the mean of several places along the footprint,
// each as wide as it is across: a round one would leave out texels, or blur them.
WISP_INLINE Color texture_of(const Scene &scene, const Triangle &triangle, const Vec3 &weights, Real width, Real cosine,
                             const Sides &sides) {
    constexpr int32_t most_places = 16;
    const Texture &texture = scene.textures[triangle.texture];
    Real u[3], v[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = to_real<Real>(triangle.texel[i][0]);
        v[i] = to_real<Real>(triangle.texel[i][1]);
    }
    const auto at = [&](Real along_u, Real along_v, Real lod) {
        return texture_at(texture, u[0] * weights.x + u[1] * weights.y + u[2] * weights.z + along_u,
                          v[0] * weights.x + v[1] * weights.y + v[2] * weights.z + along_v, lod);
    };
    const Real u1 = u[1] - u[0], v1 = v[1] - v[0], u2 = u[2] - u[0], v2 = v[2] - v[0],
               pictures = max(max(abs(u1), abs(v1)), max(abs(u2), abs(v2))),
               area = sides.sine * sides.size1 * sides.size2; // twice the triangle's
    if (!(width > Real(0)) || !(area > Real(0)) || !(pictures > Real(0))) return at(Real(0), Real(0), Real(0));
    const Real log_cosine = binary_log(max(cosine, Real(1.0 / 64)));
    const TexelEllipse ellipse = texel_ellipse(sides, u1, v1, u2, v2, pictures, texture);
    if (!(ellipse.ratio > Real(2))) {
        const Real texels =
            binary_log(abs(u1 * v2 - u2 * v1)) + binary_log(Real(texture.width)) + binary_log(Real(texture.height));
        return at(Real(0), Real(0), binary_log(width) + (texels - binary_log(area) - log_cosine) * Real(0.5));
    }
    const Real log_length = binary_log(width) + binary_log(pictures) +
                            binary_log(Real(max(texture.width, texture.height))) -
                            binary_log(min(sides.size1, sides.size2)) - binary_log(sides.sine) +
                            (binary_log(ellipse.longer) - log_cosine) * Real(0.5);
    const int32_t places = ellipse.ratio < Real(most_places) ? floor_to_int(ellipse.ratio) : most_places;
    const Real lod = log_length - binary_log(Real(places));
    if (!(log_length > Real(0)) || !(lod < Real(texture.levels - 1))) return at(Real(0), Real(0), lod); // in one texel
    const Vec3 axis = normalize(ellipse.half < Real(0)
                                    ? Vec3(ellipse.across, ellipse.root - ellipse.half, Real(0))
                                    : Vec3(ellipse.half + ellipse.root, ellipse.across, Real(0))); // the eigenvector
    const Real length = exp(log_length * Real(0.69314718055994530942)), along_u = axis.x * length / Real(texture.width),
               along_v = axis.y * length / Real(texture.height);
    Color sum(Real(0));
    for (int32_t i = 0; i < places; ++i) {
        const Real t = (Real(i) + Real(0.5)) / Real(places) - Real(0.5);
        sum += at(along_u * t, along_v * t, lod);
    }
    return sum / Real(places);
}

Point point_at(const Whitted &tracer, const Beam &beam, const Hit &hit) {
    const Scene &scene = *tracer.scene;
    const Triangle &triangle = scene.triangles[hit.triangle];
    const PlacedInstance *instance =
        hit.instance < tracer.surfaces->instance_count ? &tracer.surfaces->instances[hit.instance] : nullptr;
    Vec3 corner = vec_of(triangle.corner[0]), edge1 = vec_of(triangle.corner[1]) - corner,
         edge2 = vec_of(triangle.corner[2]) - corner;
    if (instance) {
        // Edges are transformed without the origin: far out, the corners of a small instance differ in few digits.
        corner = instance->origin + applied(instance->axis, corner);
        edge1 = applied(instance->axis, edge1);
        edge2 = applied(instance->axis, edge2);
    }
    const Vec3 weights(Real(1) - hit.u - hit.v, hit.u, hit.v);
    Point point;
    const Real size1 = largest(absolute(edge1)), size2 = largest(absolute(edge2));
    Sides sides = {edge1 / size1, edge2 / size2, size1, size2, Real(0)};
    const Vec3 product = cross(sides.first, sides.second);
    sides.sine = length(product);
    point.plane = sides.sine > Real(0) ? product / sides.sine : -beam.ray.direction;
    if (instance && scene.instances[hit.instance].mirrored)
        point.plane = -point.plane; // outside of a mirror image is the image of outside
    point.position = corner + edge1 * hit.u + edge2 * hit.v;
    point.normal = point.plane;
    const Double3 &n = triangle.normal[0];
    if (total_order_key(n.x) != 0 || total_order_key(n.y) != 0 || total_order_key(n.z) != 0) {
        Vec3 normal =
            vec_of(n) * weights.x + vec_of(triangle.normal[1]) * weights.y + vec_of(triangle.normal[2]) * weights.z;
        if (length(normal) > Real(0x1p-12)) {
            if (instance) { // times the inverse transpose, whose entries may be small
                const Vec3 *inverse = instance->inverse;
                normal = Vec3(dot(inverse[0], normal), dot(inverse[1], normal), dot(inverse[2], normal));
                const Real size = largest(absolute(normal));
                normal = size > Real(0) ? normal / size : point.plane;
            }
            point.normal = normalize(normal);
        }
        if (dot(point.plane, point.normal) < Real(0)) point.plane = -point.plane; // vertex normals point outside
    }
    const Real cosine = -dot(point.plane, beam.ray.direction);
    point.entered = !(cosine < Real(0));
    if (!point.entered) {
        point.plane = -point.plane;
        point.normal = -point.normal;
    }
    point.material = &tracer.materials[triangle.material];
    point.triangle = hit.triangle;
    point.is_static = hit.triangle < tracer.surfaces->static_count;
    point.u = hit.u;
    point.v = hit.v;
    point.instance = hit.instance;
    point.width = beam.width + tracer.spread * hit.distance;
    point.texture =
        triangle.texture < 0 ? Color(Real(1)) : texture_of(scene, triangle, weights, point.width, abs(cosine), sides);
    return point;
}

// Sets `factor`, by which the irradiance of light i is multiplied to give radiance along `direction`. False: the light
// adds nothing. A light behind the triangle's plane adds nothing, whatever the interpolated normal says. The triangle
// does not shadow itself.
bool shade_light(const Whitted &tracer, const Point &point, const Vec3 &direction, uint32_t i, const Illumination &from,
                 Color &factor) {
    const SurfaceMaterial &material = *point.material;
    const Vec3 to_light = -from.direction;
    const Real cosine = dot(point.normal, to_light);
    PixelRecorder *const recorder = tracer.recorder;
    if (!(dot(point.plane, to_light) > Real(0)) || !(cosine > Real(0)) || !(largest(from.irradiance) > Real(0))) {
        if (is_recording(recorder)) recorder->light(*recorder, {-1, i, false, from});
        return false;
    }
    const ShadowQuery query =
        make_shadow_query(*tracer.surfaces, point.position, i, from, point.triangle, point.u, point.v, point.instance);
    if (record_shadow(recorder, *tracer.statistics, [&] { return is_shadowed(*tracer.shadows, query); })) {
        if (is_recording(recorder)) recorder->light(*recorder, {-1, i, true, from});
        return false;
    }
    Real depth = Real(0), passing = Real(1);
    if (has(parts::any_smoke) && tracer.medium) {
        depth = optical_depth(*tracer.medium, query.ray, from.distance);
        passing = exp(-depth);
    }
    const Real lambert = tracer.lights[i].kind == LightKind::constant ? cosine : cosine * inv_pi<Real>;
    const Real highlight = power(dot(mirrored(-to_light, point.normal), -direction), material.shininess);
    factor = (material.diffuse * point.texture * lambert + material.specular * highlight) * passing;
    if (is_recording(recorder))
        recorder->light(*recorder, {-1, i, true, from, depth, passing, from.irradiance * factor});
    return true;
}

// Radiance that all lights send along `direction`.
Color direct_light(const Whitted &tracer, const Point &point, const Vec3 &direction) {
    Color sum(Real(0)), factor;
    if (!has(parts::light_cuts) || !tracer.cuts) {
        for (uint32_t i = 0; i < tracer.scene->light_count; ++i) {
            if (i % 64 == 63 && !tracer.watch.go_on(64 * units_of_light)) return sum;
            const Illumination from = illuminate(tracer.lights[i], point.position, point.position, point.position);
            if (shade_light(tracer, point, direction, i, from, factor)) sum += from.irradiance * factor;
        }
        return sum;
    }
    const LitPoint lit = {point.position,
                          point.plane,
                          point.normal,
                          mirrored(direction, point.normal),
                          point.material->diffuse * point.texture,
                          point.material->specular,
                          point.material->shininess};
    if (!(largest(lit.diffuse) > Real(0)) && !(largest(lit.specular) > Real(0))) return sum;
    const auto ask = [&](uint32_t i, const Illumination &from) {
        return shade_light(tracer, point, direction, i, from, factor) ? factor : Color(Real(0));
    };
    return light_of_cut(*tracer.cuts, lit, ask).sum;
}

// The reflected direction, on this side of the triangle's plane. Where the interpolated normal would send the ray
// through the plane, the plane's own normal reflects it.
WISP_INLINE Vec3 reflection(const Point &point, const Vec3 &direction) {
    const Vec3 outside = mirrored(direction, point.normal);
    return normalize(dot(outside, point.plane) > Real(0) ? outside : mirrored(direction, point.plane));
}

// Snell's law. False: total reflection. The refracted direction leads behind the plane in any case.
WISP_INLINE bool refraction(const Point &point, const Vec3 &direction, Vec3 &inside) {
    const Real index = point.material->index, ratio = point.entered ? Real(1) / index : index;
    if (ratio == Real(1)) {
        inside = direction;
        return true;
    }
    const Vec3 &normal = dot(direction, point.normal) < Real(0) ? point.normal : point.plane;
    const Real cosine = -dot(direction, normal), rest = Real(1) - ratio * ratio * (Real(1) - cosine * cosine);
    if (rest < Real(0)) return false;
    inside = normalize(direction * ratio + normal * (ratio * cosine - sqrt(rest)));
    if (!(dot(inside, point.plane) < Real(0))) inside = direction;
    return true;
}

// What a beam hits, or the background: the radiance without rays that go on, and those rays. `level` has none yet.
void shade(const Whitted &tracer, const Beam &beam, const Hit &hit, RayLevel &level) {
    level.behind = tracer.background;
    if (!hit.found) return;
    const Point point = point_at(tracer, beam, hit);
    const SurfaceMaterial &material = *point.material;
    const Vec3 &direction = beam.ray.direction;
    level.behind = material.ambient * point.texture;
    if (is_recording(tracer.recorder)) {
        const Triangle &triangle = tracer.scene->triangles[hit.triangle];
        const bool in_instance = hit.instance < tracer.surfaces->instance_count;
        tracer.recorder->hit(*tracer.recorder,
                             {hit.distance, hit.triangle, in_instance ? static_cast<int32_t>(hit.instance) : -1,
                              point.is_static, triangle.material, triangle.texture, hit.u, hit.v, point.position,
                              point.plane, point.normal, point.entered, point.texture, level.behind});
    }
    const Color lit = direct_light(tracer, point, direction);
    if (is_recording(tracer.recorder)) tracer.recorder->direct_light(*tracer.recorder, lit);
    level.behind += lit;
    level.position = point.position;
    level.width = point.width;
    level.triangle = point.triangle;
    const Color passing(material.transmission);
    const bool passes = material.transmission > Real(0) && refraction(point, direction, level.direction[refracted]);
    level.direction[reflected] = reflection(point, direction);
    level.factor[reflected] = material.specular + (passes ? Color(Real(0)) : passing);
    level.factor[refracted] = passing;
    level.count = passes ? 2 : 1;
}

// Follows a ray to what it hits.
void follow(const Whitted &tracer, const Beam &beam, Real begin, uint32_t depth, Real weight) {
    RayLevel &level = tracer.levels[depth];
    level = {};
    if (!tracer.watch.go_on(units_of_ray)) return;
    TreeCounts asked = {};
    const Hit hit =
        tracer.nearest_hit(*tracer.surfaces, beam.ray, begin, infinite_distance, beam.ignore_triangle, asked);
    if (depth == 0) record_primary_hit(*tracer.shadows, beam.ray, hit);
    level.smoke = empty_segment();
    if (has(parts::any_smoke) && tracer.medium)
        level.smoke =
            tracer.march(tracer.marcher, beam.ray, hit.found ? hit.distance : infinite_distance, tracer.recorder);
    level.weight = weight * level.smoke.transmittance;
    level.found = hit.found;
    level.node_visits = asked.node_visits;
    shade(tracer, beam, hit, level);
}

// Sends the next ray that goes on. False: its weight is too small to be worth a ray, or the chain is too long.
bool send_next(const Whitted &tracer, uint32_t depth) {
    RayLevel &level = tracer.levels[depth];
    const uint32_t i = level.next++;
    const Color &factor = level.factor[i];
    const Real rest = level.weight * largest(factor);
    const RayKind kind = i == reflected ? RayKind::reflected : RayKind::refracted;
    PixelRecorder *const recorder = tracer.recorder;
    if (depth == tracer.depth || rest < min_ray_weight) {
        if (is_recording(recorder) && rest > Real(0))
            recorder->unsent(*recorder, kind, factor, rest, !(rest < min_ray_weight));
        return false;
    }
    auto &rays = tracer.statistics->rays;
    ++(i == reflected ? rays.reflected : rays.refracted);
    const Beam beam = {{level.position, level.direction[i]}, level.width, level.triangle};
    if (is_recording(recorder)) recorder->ray(*recorder, kind, depth + 1, beam.ray, factor, rest);
    follow(tracer, beam, tracer.surfaces->ray_epsilon, depth + 1, rest);
    return true;
}

// Radiance along a ray, when all that go on from what it hit have come back.
Color radiance_of(const Whitted &tracer, const RayLevel &level) {
    const Segment &smoke = level.smoke;
    const Color radiance = tracer.medium ? smoke.radiance + level.behind * smoke.transmittance : level.behind;
    tracer.statistics->rays.saturated += is_saturated(radiance);
    if (is_recording(tracer.recorder))
        tracer.recorder->ray_end(*tracer.recorder, {level.found, smoke.radiance, smoke.transmittance, level.behind,
                                                    radiance, level.node_visits});
    return radiance;
}

} // namespace

SurfaceMaterial *make_surface_materials(const Scene &scene, Arena &arena) {
    SurfaceMaterial *materials = arena.make<SurfaceMaterial>(scene.material_count);
    for (uint32_t i = 0; materials && i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        materials[i] = {vec_of(m.ambient),
                        vec_of(m.diffuse),
                        vec_of(m.specular),
                        to_real<Real>(m.shininess),
                        to_real<Real>(m.transmission),
                        to_real<Real>(m.index)};
    }
    return materials;
}

// Recursion without the stack: the ray that is followed, and those of which it is a part, are the levels up to `depth`.
Color trace(const Whitted &tracer, const Ray &ray) {
    if (is_recording(tracer.recorder))
        tracer.recorder->ray(*tracer.recorder, RayKind::camera, 0, ray, Color(Real(1)), Real(1));
    follow(tracer, {ray, Real(0), no_triangle}, Real(0), 0, Real(1));
    for (uint32_t depth = 0;;) {
        const RayLevel &level = tracer.levels[depth];
        if (level.next < level.count) {
            if (send_next(tracer, depth)) ++depth;
            continue;
        }
        const Color radiance = radiance_of(tracer, level);
        if (depth == 0) return radiance;
        RayLevel &before = tracer.levels[--depth];
        before.behind += before.factor[before.next - 1] * radiance;
    }
}

} // namespace wisp::WISP_ARITH

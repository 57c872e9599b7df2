#include "core/smoke/density_statistics.h"
#include "core/smoke/particle_field.h"

namespace wisp::WISP_ARITH {

namespace {

template <class K> DensityStatistics statistics_of(const K &kernel, const ParticleField &field, uint32_t slot) {
    const PointTree &tree = field.tree;
    const Vec3 x(tree.x[slot], tree.y[slot], tree.z[slot]);
    Real sum[lanes] = {};
    uint32_t count[lanes] = {};
    for_each_leaf_near(field, x, Real(0), [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes)
            for (uint32_t l = 0; l < lanes; ++l) {
                const uint32_t i = first + l;
                const Real dx = tree.x[i] - x.x, dy = tree.y[i] - x.y, dz = tree.z[i] - x.z;
                const Real h = field.inverse_h[i], q_squared = sum_of_products(dx, dx, dy, dy, dz, dz) * (h * h);
                // Empty slots have an inverse_h of 0.
                const bool other = i != slot && h > Real(0) && q_squared < kernel.support_squared;
                sum[l] += other ? (field.scale[i] * h) * kernel.value(q_squared) : Real(0); // S3
                count[l] += other ? 1u : 0u;
            }
    });
    uint32_t neighbours = 0;
    for (uint32_t c : count) neighbours += c;
    return {neighbours, to_double(sum_of_lanes(sum))};
}

WISP_MULTIVERSIONED DensityStatistics statistics_at(const ParticleField &field, uint32_t slot) {
    return with_kernel(field.kernel, [&](const auto &kernel) { return statistics_of(kernel, field, slot); });
}

} // namespace

uint64_t density_statistics_bytes(uint32_t particles) { return particle_field_bytes(particles); }

bool find_density_statistics(const SmokeDescription &source, Arena &arena, DensityStatistics *per_particle) {
    const ParticleField field = make_particle_field(source, 0, arena);
    if (!field.ready) return false;
    for (uint32_t slot = 0; slot < source.count; ++slot) per_particle[field.tree.id[slot]] = statistics_at(field, slot);
    return true;
}

} // namespace wisp::WISP_ARITH

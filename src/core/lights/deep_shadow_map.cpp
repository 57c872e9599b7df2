// The lines of a deep shadow map, found row by row.
#include "core/lights/deep_shadow_map.h"
#include "core/numbers/double_bits.h"
#include "core/smoke/grid_samples.h"
#include "core/smoke/sparse_grid_lanes.h"

namespace wisp::WISP_ARITH {

namespace {

// Adds sigma_t of all smokes at the distances `t` to `sum`.
WISP_MULTIVERSIONED void add_extinctions(const Medium &medium, const GridRay &ray, const Lanes &t, Lanes &sum) {
    LanePoints points;
    find_points(*medium.bricks, ray, t, points);
    LaneCells at;
    find_cells(points, 1, 1, at);
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_resampled) continue; // this smoke is empty
        Lanes sigma;
        interpolate(at, medium.smokes[i].field.resampled.extinction, sigma);
        for (uint32_t l = 0; l < lanes; ++l) sum[l] += points.inside[l] ? sigma[l] : Real(0);
    }
}

// Marks in place of a line's first depth: the line was not found yet; it misses smoke that is cut off.
constexpr Real unknown = Real(-1), misses = Real(-2);

// Whether the density is above 0 at the faces of a grid. Sums over particles fall to 0 before they end.
bool is_dense_at_faces(const SmokeDescription &smoke) {
    const GridDescription &grid = smoke.grid;
    if (!smoke.is_grid()) return false;
    if (!grid.density) return true;
    const auto is_border = [](int32_t i, int32_t n) { return i == 0 || i == n - 1; };
    return !for_each_run(grid, [&](int32_t first, int32_t y, int32_t z, const float *densities, int32_t count) {
        const bool whole = is_border(y, grid.ny) || is_border(z, grid.nz);
        for (int32_t i = 0; i < count; ++i)
            if ((whole || is_border(first + i, grid.nx)) && total_order_key(densities[i]) > 0) return false;
        return true;
    });
}

// The cubic of Catmull and Rom through four equally spaced values, at t from 0 to 1 between values 1 and 2.
struct CatmullRom {
    Real weight[4];
    explicit CatmullRom(Real t) {
        const Real half_t = t * Real(0.5), r = Real(1) - t;
        weight[0] = -half_t * r * r;
        weight[1] = r * (Real(1) + t - Real(1.5) * t * t);
        weight[2] = t * (Real(1) + r - Real(1.5) * r * r);
        weight[3] = -half_t * t * r;
    }
    template <class Value> Real operator()(Value &&value) const {
        return (weight[0] * value(0) + weight[1] * value(1)) + (weight[2] * value(2) + weight[3] * value(3));
    }
};

} // namespace

bool is_cut_off(const Medium &medium) {
    for (uint32_t i = 0; i < medium.count; ++i)
        if (is_dense_at_faces(*medium.smokes[i].source)) return true;
    return false;
}

uint32_t light_face(const Light &light, const Vec3 &x) {
    const Vec3 direction = light.kind == LightKind::parallel ? light.direction : x - light.position;
    const uint32_t axis = largest_axis(direction);
    return 2 * axis + (direction[static_cast<int>(axis)] < Real(0) ? 1 : 0);
}

DeepShadowMap::DeepShadowMap(const Medium &medium, bool cut_off, const Light &light, uint32_t face, const Box &bounds)
    : medium_(&medium), cut_off_(cut_off), fans_(light.kind != LightKind::parallel),
      axis_(static_cast<int32_t>(face / 2)), from_(fans_ ? light.position : (bounds.low + bounds.high) * Real(0.5)),
      sign_(face % 2 ? Real(-1) : Real(1)) {
    if (!fans_ && light_face(light, from_) != face) return;
    const Real low = sign_ * (bounds.low[axis_] - from_[axis_]), high = sign_ * (bounds.high[axis_] - from_[axis_]);
    const Real far = max(low, high);
    begin_ = fans_ ? max(min(low, high), Real(0)) : min(low, high);
    if (!(far > begin_)) return;
    const Vec3 &cell = medium.bricks->cell;
    Real squared = Real(1); // of the length of the longest line per unit of height
    Real first[2], last[2]; // the range of the lines: slopes, or offsets
    for (int32_t s = 0; s < 2; ++s) {
        side_[s] = (axis_ + 1 + s) % 3;
        const Real left = bounds.low[side_[s]] - from_[side_[s]], right = bounds.high[side_[s]] - from_[side_[s]];
        if (fans_) {
            // A face ends where another component becomes the largest: at slopes of -1 and 1.
            const auto slope = [&](Real aside, Real height) {
                return abs(aside) < height ? aside / height : aside < Real(0) ? Real(-1) : Real(1);
            };
            first[s] = min(slope(left, begin_), slope(left, far));
            last[s] = max(slope(right, begin_), slope(right, far));
        } else {
            slope_[s] = light.direction[side_[s]] / (sign_ * light.direction[axis_]);
            const Real aside_near = slope_[s] * begin_, aside_far = slope_[s] * far;
            first[s] = left - max(aside_near, aside_far), last[s] = right - min(aside_near, aside_far);
        }
        distance_[s] = Real(1.5) * (fans_ ? cell[side_[s]] / far : cell[side_[s]]);
        const Real aside = fans_ ? max(abs(first[s]), abs(last[s])) : abs(slope_[s]);
        squared += aside * aside;
    }
    const Real layers = (far - begin_) * sqrt(squared) / min(cell.x, min(cell.y, cell.z));
    if (!(layers < Real(1 << 14))) return;
    layers_ = static_cast<uint32_t>(floor_to_int(layers)) + 1;
    layer_ = (far - begin_) / Real(static_cast<int32_t>(layers_));
    inverse_layer_ = Real(static_cast<int32_t>(layers_)) / (far - begin_);
    uint32_t count[2];
    for (int32_t s = 0; s < 2; ++s) {
        const Real lines = (last[s] - first[s]) / distance_[s];
        if (!(lines < Real(1 << 14))) return;
        inverse_distance_[s] = Real(1) / distance_[s];
        low_[s] = first[s] - distance_[s]; // the cubic needs one more line before and two behind
        count[s] = static_cast<uint32_t>(floor_to_int(lines)) + 4;
    }
    count_[0] = count[0], count_[1] = count[1];
}

DeepShadowMap::Place DeepShadowMap::place_of(const Vec3 &x) const {
    const Real height = max(sign_ * (x[axis_] - from_[axis_]), max(begin_, fans_ ? layer_ * Real(0x1p-10) : begin_));
    Real across[2];
    for (int32_t s = 0; s < 2; ++s) {
        const Real aside = x[side_[s]] - from_[side_[s]];
        const Real q = ((fans_ ? aside / height : aside - slope_[s] * height) - low_[s]) * inverse_distance_[s];
        across[s] = min(max(q, Real(1)), Real(static_cast<int32_t>(count_[s]) - 3));
    }
    const Real layer = min((height - begin_) * inverse_layer_, Real(static_cast<int32_t>(layers_)));
    return {across[0], across[1], layer};
}

Box DeepShadowMap::lines_around(const Vec3 &x) const {
    const Place at = place_of(x);
    const int32_t layer = min(truncate(at.layer), static_cast<int32_t>(layers_) - 1);
    const Real near = begin_ + Real(layer) * layer_, far = near + layer_, place[2] = {at.u, at.v};
    const Box &smoke = medium_->bricks->bounds;
    Box lines;
    const auto clamped = [&](Real height) {
        return min(max(from_[axis_] + sign_ * height, smoke.low[axis_]), smoke.high[axis_]);
    };
    lines.low[axis_] = min(clamped(near), clamped(far));
    lines.high[axis_] = max(clamped(near), clamped(far));
    for (int32_t s = 0; s < 2; ++s) {
        const Real before = low_[s] + Real(truncate(place[s]) - 1) * distance_[s],
                   behind = before + Real(3) * distance_[s];
        const auto at_height = [&](Real line, Real height) {
            return from_[side_[s]] + (fans_ ? line * height : line + slope_[s] * height);
        };
        lines.low[side_[s]] = min(at_height(before, near), at_height(before, far));
        lines.high[side_[s]] = max(at_height(behind, near), at_height(behind, far));
    }
    return lines;
}

void DeepShadowMap::begin_row(uint32_t row, Real *cache) const {
    for (uint32_t column = 0; column < count_[0]; ++column) *line(cache, row, column) = unknown;
}

void DeepShadowMap::find_line(uint32_t row, uint32_t column, Real *depth) const {
    const SparseGrid &bricks = *medium_->bricks;
    const uint32_t at[2] = {column, row};
    Ray ray; // distances along this ray are heights above begin_
    ray.direction[axis_] = sign_;
    ray.origin[axis_] = from_[axis_] + sign_ * begin_;
    Real squared = Real(1);
    for (int32_t s = 0; s < 2; ++s) {
        const Real aside = low_[s] + Real(static_cast<int32_t>(at[s])) * distance_[s];
        const Real slope = fans_ ? aside : slope_[s];
        ray.direction[side_[s]] = slope;
        ray.origin[side_[s]] = from_[side_[s]] + slope * begin_ + (fans_ ? Real(0) : aside);
        squared += slope * slope;
    }
    const Real length = layer_ * sqrt(squared);
    for (uint32_t k = 0; k <= layers_; ++k) depth[k] = Real(0);
    Real entry = Real(0), end = layer_ * Real(static_cast<int32_t>(layers_));
    if (!clip(bricks.bounds, ray, entry, end)) {
        if (cut_off_) depth[0] = misses;
        return;
    }

    // depth[k + 1] holds the depth of layer k alone. Layers without smoke are skipped.
    const GridRay grid_ray(bricks, ray);
    uint32_t next = 0;
    for_each_brick(bricks, ray, entry, end, [&](uint32_t, Real from, Real to) {
        const uint32_t first = static_cast<uint32_t>(floor_to_int(max(from, Real(0)) * inverse_layer_)),
                       last = min(static_cast<uint32_t>(floor_to_int(to * inverse_layer_)), layers_ - 1);
        for (next = max(next, first); next <= last; next += lanes) {
            Lanes t, fraction, sigma = {};
            for (uint32_t l = 0; l < lanes; ++l) {
                const Real low = Real(static_cast<int32_t>(next + l)) * layer_;
                const Real layer_begin = max(low, entry), layer_end = min(low + layer_, end);
                t[l] = (layer_begin + layer_end) * Real(0.5);
                fraction[l] = max(layer_end - layer_begin, Real(0)) * inverse_layer_;
            }
            add_extinctions(*medium_, grid_ray, t, sigma);
            for (uint32_t l = 0; l < lanes && next + l < layers_; ++l)
                depth[next + l + 1] = sigma[l] * fraction[l] * length;
        }
        return true;
    });
    for (uint32_t k = 0; k < layers_; ++k) depth[k + 1] += depth[k];
}

Real DeepShadowMap::depth(const Vec3 &x, Real *cache, uint64_t &found) const {
    const Place at = place_of(x);
    const int32_t column = truncate(at.u), row = truncate(at.v),
                  layer = min(truncate(at.layer), static_cast<int32_t>(layers_) - 1);
    const CatmullRom across(at.u - Real(column)), down(at.v - Real(row));
    const Real t = at.layer - Real(layer);
    const auto line_at = [&](int32_t i, int32_t j) {
        return line(cache, static_cast<uint32_t>(row + j - 1), static_cast<uint32_t>(column + i - 1));
    };
    for (int32_t j = 0; j < 4; ++j)
        for (int32_t i = 0; i < 4; ++i) {
            Real *depth = line_at(i, j);
            if (*depth == unknown) {
                find_line(static_cast<uint32_t>(row + j - 1), static_cast<uint32_t>(column + i - 1), depth);
                ++found;
            }
            if (*depth == misses) return misses;
        }
    return max(Real(0), down([&](int32_t j) {
                   return across([&](int32_t i) {
                       const Real *depth = line_at(i, j) + layer;
                       return mix(depth[0], depth[1], t);
                   });
               }));
}

} // namespace wisp::WISP_ARITH

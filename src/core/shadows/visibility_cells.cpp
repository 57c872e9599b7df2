// Cells of triangles: how they are found, and how their memory is taken and returned.
#include "core/shadows/visibility_cells.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint64_t max_blocks = uint64_t{1} << 19;

uint32_t roots_for(const Scene &scene) { return scene.static_count / 4 + 1; }

uint64_t blocks_for(const Scene &scene, const Settings &settings) {
    constexpr uint64_t frames = 6;
    const uint64_t queries = settings.crop.pixels() * settings.samples;
    const uint64_t of_light =
        roots_for(scene) + min(queries, max_blocks * rays_before_split) * frames / rays_before_split;
    return min(max_blocks, 1 + min(of_light, max_blocks) * scene.light_count); // block 0 means none
}

// 0: no block is left.
uint32_t take_block(ShadowCells &cells, uint32_t occluder) {
    uint32_t block = cells.spare;
    if (block != 0)
        cells.spare = cells.blocks[block][0].children();
    else if (cells.used < cells.block_count)
        block = cells.used++;
    else
        return 0;
    for (ShadowCell &cell : cells.blocks[block]) cell = {occluder, 0};
    return block;
}

void return_block(ShadowCells &cells, uint32_t block) {
    for (const ShadowCell &cell : cells.blocks[block])
        if (cell.children() != 0) return_block(cells, cell.children());
    cells.blocks[block][0].set_children(cells.spare);
    cells.spare = block;
}

bool same_place(const Light &a, const Light &b) { // a cone decides only whether there is a query
    if (a.kind != b.kind) return false;
    return a.kind == LightKind::parallel ? a.direction == b.direction : a.position == b.position;
}

// A weight in units of 2^-62, rounded down.
inline int64_t weight_of(double x) { return static_cast<int64_t>(x * 0x1p62); }
inline int64_t weight_of(float x) { return weight_of(static_cast<double>(x)); }
inline int64_t weight_of(Fixed x) { return x.raw() * (int64_t{1} << 30); }

} // namespace

uint64_t shadow_cell_bytes(const Scene &scene, const Settings &settings) {
    return Arena::bytes<ShadowCell[4]>(blocks_for(scene, settings)) + Arena::bytes<Light>(scene.light_count) +
           Arena::bytes<uint32_t>(uint64_t{scene.light_count} * roots_for(scene));
}

ShadowCells make_shadow_cells(const Scene &scene, const Settings &settings, Arena &arena, Watch watch) {
    ShadowCells cells = {};
    cells.block_count = static_cast<uint32_t>(blocks_for(scene, settings));
    cells.roots_per_light = roots_for(scene);
    const size_t roots = size_t{scene.light_count} * cells.roots_per_light;
    cells.roots = arena.make<uint32_t>(roots);
    cells.lights = make_lights(scene, arena);
    cells.blocks = arena.make<ShadowCell[4]>(cells.block_count);
    cells.ready = cells.roots && cells.lights && cells.blocks && fill(cells.roots, roots, uint32_t{0}, watch);
    if (!cells.ready) return cells;
    cells.light_count = scene.light_count;
    cells.used = 1; // block 0 means none
    return cells;
}

void update_shadow_cells(ShadowCells &cells, const Light *lights, uint32_t light_count) {
    for (uint32_t i = 0; i < min(light_count, cells.light_count); ++i) {
        if (same_place(lights[i], cells.lights[i])) continue;
        cells.lights[i] = lights[i];
        uint32_t *roots = cells.roots + size_t{i} * cells.roots_per_light;
        for (uint32_t r = 0; r < cells.roots_per_light; ++r) {
            if (roots[r] != 0) return_block(cells, roots[r]);
            roots[r] = 0;
        }
    }
}

ShadowCell *find_shadow_cell(ShadowCells &cells, uint32_t light, uint32_t triangle, Real u, Real v, CellPlace &place) {
    if (light >= cells.light_count) return nullptr;
    uint32_t &root = cells.roots[size_t{light} * cells.roots_per_light + triangle / 4];
    if (root == 0) root = take_block(cells, no_triangle);
    if (root == 0) return nullptr;
    ShadowCell *cell = &cells.blocks[root][triangle % 4];
    place = {0, 0, finest_cell};
    constexpr int64_t one = int64_t{1} << 62;
    int64_t x = min(weight_of(u), one - 1),
            y = min(weight_of(v), one - 1); // in the cell, its size being `one`, 2 half, ...
    for (int64_t half = one / 2; cell->children() != 0; half /= 2) {
        const int half_size = place.size / 2;
        uint32_t child = 0;
        if (x >= half) {
            child = 1;
            x -= half;
            place.u += half_size;
        } else if (y >= half) {
            child = 2;
            y -= half;
            place.v += half_size;
        } else if (x + y >= half) {
            child = 3;
            x = half - x;
            y = half - y;
            place.u += half_size;
            place.v += half_size;
        }
        place.size = child == 3 ? -half_size : half_size;
        cell = &cells.blocks[cell->children()][child];
    }
    return cell;
}

void split(ShadowCells &cells, ShadowCell &cell, const CellPlace &place) {
    if (place.size != 1 && place.size != -1) cell.set_children(take_block(cells, cell.occluder));
}

} // namespace wisp::WISP_ARITH

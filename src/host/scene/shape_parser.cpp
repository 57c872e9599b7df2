#include "host/base/double3_algebra.h"
#include "host/base/text.h"
#include "host/scene/shape_parser.h"
#include "host/scene/tessellate.h"
#include <algorithm>
#include <stdexcept>

namespace wisp {

namespace {

// What every arithmetic holds, after several reflections too.
constexpr double max_color = 1000, max_shininess = 1e7, max_index = 1000, max_texel = coordinate_limit;
constexpr size_t max_fine_spheres = 1000; // of a scene: where there are more none is fine

// Of shapes before the first material: a grey that is lit.
const FileMaterial single_channel = {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0, 0, 0}, 0, 0, 1};

} // namespace

const ShapeParser::Statements &ShapeParser::table() {
    static const Statements statements = {
        {"f", &ShapeParser::plain_material},
        {"fm", &ShapeParser::full_material},
        {"s", &ShapeParser::sphere},
        {"c", &ShapeParser::cone},
        {"p", &ShapeParser::polygon},
        {"pp", &ShapeParser::patch},
        {"m", &ShapeParser::mesh},
        {"tt", &ShapeParser::textured_triangle},
        {"ttp", &ShapeParser::textured_patch},
        {"tpa", &ShapeParser::animated_triangle},
    };
    return statements;
}

bool ShapeParser::parse(std::string_view word, int32_t node) {
    const auto found = table().find(word);
    if (found == table().end()) return false;
    node_ = node;
    (this->*found->second)();
    return true;
}

std::string ShapeParser::statements() {
    std::string names;
    for (const auto &entry : table()) names.append(entry.first) += ' ';
    return names;
}

void ShapeParser::plain_material() {
    const Double3 color = tokens_.color("the material");
    const double diffuse = tokens_.number_in("a diffuse part Kd from 0 to 1000", 0, max_color);
    const double specular = tokens_.number_in("a specular part Ks from 0 to 1000", 0, max_color);
    finish_material({color * diffuse, color * diffuse, {specular, specular, specular}, 0, 0, 1});
}

void ShapeParser::full_material() {
    const Double3 ambient = tokens_.color("the ambient colour"), diffuse = tokens_.color("the diffuse colour");
    finish_material({ambient, diffuse, tokens_.color("the specular colour"), 0, 0, 1});
}

void ShapeParser::finish_material(FileMaterial material) {
    for (const Double3 &color : {material.ambient, material.diffuse, material.specular})
        if (largest(color) > max_color) tokens_.fail("found a colour of a material above 1000, expected less");
    material.shininess = tokens_.number_in("a shininess from 0 to 1e7", 0, max_shininess);
    material.transmission = tokens_.number_in("a transmission from 0 to 1", 0, 1);
    material.index = tokens_.number_in("an index of refraction up to 1000", -1e30, max_index);
    if (material.index > 0 && material.index < 1 / max_index)
        tokens_.fail("found index " + tokens_.last() + ", expected 0, or one from 0.001 to 1000");
    use(material);
}

void ShapeParser::use(const FileMaterial &m) {
    const Double3 &a = m.ambient, &d = m.diffuse, &s = m.specular;
    const std::array<double, 12> values = {a.x,    a.y, a.z, d.x, d.y, d.z, s.x, s.y, s.z, m.shininess, m.transmission,
                                           m.index};
    const auto [found, is_new] = materials_.try_emplace(values, static_cast<uint32_t>(graph_.materials.size()));
    if (is_new) graph_.materials.push_back(m);
    material_ = found->second;
}

uint32_t ShapeParser::material() {
    if (!material_) use(single_channel);
    return *material_;
}

int32_t ShapeParser::texture(std::string_view file) {
    const auto [found, is_new] =
        textures_.try_emplace(tokens_.beside(file), static_cast<int32_t>(graph_.textures.size()));
    if (is_new) graph_.textures.push_back({found->first, tokens_.where()});
    return found->second;
}

std::array<double, 2> ShapeParser::texel() {
    const double u = tokens_.number_in("u from -8192 to 8192", -max_texel, max_texel);
    return {u, tokens_.number_in("v from -8192 to 8192", -max_texel, max_texel)};
}

std::vector<Double3> ShapeParser::vectors(size_t count, std::string_view what) {
    std::vector<Double3> result(count);
    for (Double3 &v : result) v = tokens_.vector(what);
    return result;
}

void ShapeParser::add_triangles(size_t count) {
    triangles_ += count;
    if (triangles_ > max_triangles_)
        tokens_.fail("more than " + std::to_string(max_triangles_) + " triangles, expected no more");
}

void ShapeParser::warn(const char *kind, const std::string &text) {
    graph_.warnings.push_back({kind, tokens_.where(), text});
}

void ShapeParser::add(Mesh &&mesh) {
    const auto has_area = [&at = mesh.positions](const Mesh::Row &row) {
        const Double3 &a = at[row.corner[0]], &b = at[row.corner[1]], &c = at[row.corner[2]];
        return largest_component(cross(b - a, c - a)) > 0;
    };
    if (std::none_of(mesh.rows.begin(), mesh.rows.end(), has_area))
        warn("no area", "the surface has no area: it is invisible");
    if (mesh.rows.empty()) return;
    add_triangles(mesh.rows.size());
    mesh.node = node_;
    mesh.material = material();
    graph_.meshes.push_back(std::move(mesh));
}

void ShapeParser::sphere() {
    const Double3 center = tokens_.vector("the sphere's centre");
    const double radius = tokens_.number("the sphere's radius");
    if (radius == 0) tokens_.fail("found radius 0, expected another");
    add_triangles(sphere_triangles(spheres_.size() < max_fine_spheres));
    spheres_.push_back({center, radius, graph_.meshes.size(), tokens_.where()});
    graph_.meshes.push_back({node_, material(), -1, {}, {}, {}, {}});
}

void ShapeParser::warn_of_flat_sphere(const std::vector<Place> &places, bool fine) {
    const auto in_world = [this](const Sphere &sphere) { return graph_.meshes[sphere.mesh].node < 0; };
    const Sphere *largest = nullptr; // the ground, as a rule
    for (const Sphere &sphere : spheres_)
        if (in_world(sphere) && (!largest || std::fabs(sphere.radius) > std::fabs(largest->radius))) largest = &sphere;
    if (!largest) return;
    const SphereError error = sphere_error(fine);
    const double radius = std::fabs(largest->radius);
    // Warns where the triangles reach a tenth of what is so large, next to the sphere.
    const auto warns = [&](const std::string &what, const Double3 &at, double size) {
        const double above = length(at - largest->center) - radius,
                     reach = (above < 0 ? error.inside : error.outside) * radius;
        if (!(std::fabs(above) < size + reach) || reach < 0.1 * size) return false;
        graph_.warnings.push_back({"sphere", largest->where,
                                   what + " may lie on the wrong side of this sphere: it is made of " +
                                       std::to_string(sphere_triangles(fine)) + " flat triangles, which reach up to " +
                                       six_digits(reach) + (above < 0 ? " into" : " out of") +
                                       " it; a smaller sphere errs by less, a polygon by nothing"});
        return true;
    };
    for (const Place &place : places)
        if (warns(place.name, place.at, 0)) return;
    for (const Sphere &sphere : spheres_) {
        const double size = std::fabs(sphere.radius);
        if (&sphere != largest && in_world(sphere) &&
            warns("a sphere of radius " + six_digits(size), sphere.center, size))
            return;
    }
}

void ShapeParser::finish(const std::vector<Place> &places) {
    const bool fine = spheres_.size() <= max_fine_spheres;
    warn_of_flat_sphere(places, fine);
    for (const Sphere &sphere : spheres_) {
        Mesh &mesh = graph_.meshes[sphere.mesh], made = sphere_mesh(sphere.center, sphere.radius, fine);
        mesh.positions = std::move(made.positions);
        mesh.normals = std::move(made.normals);
        mesh.rows = std::move(made.rows);
    }
}

void ShapeParser::cone() {
    const Double3 base = tokens_.vector("the base");
    const double base_radius = tokens_.number("the base's radius");
    const Double3 apex = tokens_.vector("the apex");
    const double apex_radius = tokens_.number("the apex's radius");
    if (base.x == apex.x && base.y == apex.y && base.z == apex.z)
        tokens_.fail("base and apex are the same point, expected two");
    if (base_radius == 0 && apex_radius == 0) tokens_.fail("both radii are 0, expected at most one");
    if ((base_radius < 0 && apex_radius > 0) || (base_radius > 0 && apex_radius < 0))
        tokens_.fail("one radius is below 0 and one above, expected the same sign");
    add(cone_mesh(base, base_radius, apex, apex_radius));
}

void ShapeParser::polygon() {
    const size_t count = tokens_.count("the polygon's corners", 3, 3);
    add_polygon(vectors(count, "a corner"), {});
}

void ShapeParser::patch() {
    std::vector<Double3> corners(tokens_.count("the patch's corners", 3, 6)), normals(corners.size());
    for (size_t i = 0; i < corners.size(); ++i) {
        corners[i] = tokens_.vector("a corner");
        normals[i] = tokens_.vector("a normal");
    }
    add_polygon(corners, normals);
}

void ShapeParser::add_polygon(const std::vector<Double3> &corners, const std::vector<Double3> &normals) {
    try {
        add(polygon_mesh(corners, normals));
        if (crosses_itself(corners)) warn("crossing", "the polygon crosses itself: parts of it are missing");
    } catch (const std::invalid_argument &error) {
        tokens_.fail(std::string("found ") + error.what());
    }
}

void ShapeParser::mesh() {
    Mesh mesh = {};
    mesh.texture = -1;
    tokens_.keyword("vertices");
    mesh.positions = vectors(tokens_.count("the mesh's vertices", 1, 3), "a vertex");
    if (tokens_.accept("normals")) mesh.normals = vectors(tokens_.count("the mesh's normals", 1, 3), "a normal");
    if (tokens_.accept("texturecoords")) {
        mesh.texels.resize(tokens_.count("the mesh's texture coordinates", 1, 2));
        mesh.texture = texture(tokens_.name("a texture's file"));
        for (auto &t : mesh.texels) t = texel();
    }
    tokens_.keyword("triangles");
    const size_t words = 3 + (mesh.normals.empty() ? 0 : 3) + (mesh.texels.empty() ? 0 : 3);
    mesh.rows.resize(tokens_.count("the mesh's triangles", 1, words));
    const auto indices = [this](std::array<uint32_t, 3> &three, size_t size, std::string_view what) {
        if (size == 0) return;
        for (uint32_t &i : three) i = static_cast<uint32_t>(tokens_.integer(what, 0, static_cast<int64_t>(size) - 1));
    };
    for (Mesh::Row &row : mesh.rows) {
        indices(row.corner, mesh.positions.size(), "a triangle's vertex");
        indices(row.normal, mesh.normals.size(), "a triangle's normal");
        indices(row.texel, mesh.texels.size(), "a triangle's texture coordinates");
    }
    add(std::move(mesh));
}

void ShapeParser::textured_triangle() {
    Mesh mesh = {};
    mesh.texture = texture(tokens_.name("a texture's file"));
    for (int i = 0; i < 3; ++i) {
        mesh.positions.push_back(tokens_.vector("a corner"));
        mesh.texels.push_back(texel());
    }
    mesh.rows = {{{0, 1, 2}, {0, 0, 0}, {0, 1, 2}}};
    add(std::move(mesh));
}

void ShapeParser::textured_patch() {
    Mesh mesh = {};
    mesh.texture = texture(tokens_.name("a texture's file"));
    for (int i = 0; i < 3; ++i) {
        mesh.positions.push_back(tokens_.vector("a corner"));
        mesh.normals.push_back(tokens_.vector("a normal"));
        mesh.texels.push_back(texel());
    }
    mesh.rows = {{{0, 1, 2}, {0, 1, 2}, {0, 1, 2}}};
    add(std::move(mesh));
}

void ShapeParser::animated_triangle() {
    DeformingTriangle triangle = {node_, 0, {}};
    triangle.keyframes.resize(tokens_.count("the triangle's times", 1, 19));
    for (size_t i = 0; i < triangle.keyframes.size(); ++i) {
        DeformingTriangle::Keyframe &key = triangle.keyframes[i];
        key.time = tokens_.number("a time");
        if (i > 0 && key.time < triangle.keyframes[i - 1].time)
            tokens_.fail("found time " + tokens_.last() + " behind a later one, expected ascending times");
        for (size_t k = 0; k < 3; ++k) {
            key.corners[k] = tokens_.vector("a corner");
            key.normals[k] = tokens_.vector("a normal");
        }
    }
    triangle.material = material();
    add_triangles(1);
    graph_.deforming.push_back(std::move(triangle));
}

} // namespace wisp

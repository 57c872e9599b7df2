// Statements about surfaces: materials `f fm`, and shapes `s c p pp m tt ttp tpa`, which take the last material.
#pragma once
#include "host/scene/scene_graph.h"
#include "host/scene/scene_tokens.h"
#include <array>
#include <map>
#include <optional>

namespace wisp {

class ShapeParser {
  public:
    ShapeParser(SceneTokens &tokens, SceneGraph &graph, size_t max_triangles)
        : tokens_(tokens), graph_(graph), max_triangles_(max_triangles) {}

    // Reads the rest of the statement `word`, in the space of a node; false if it is not a statement about surfaces.
    bool parse(std::string_view word, int32_t node);
    static std::string statements(); // each followed by a space

    // Call at the end: makes the spheres, coarse ones where there are many. Throws before that where there would be too
    // many triangles. Warns where one of these places, or a sphere, is as near to the largest sphere as its triangles
    // are.
    struct Place {
        const char *name;
        Double3 at; // in the world
    };
    void finish(const std::vector<Place> &places);

  private:
    using Statements = std::map<std::string_view, void (ShapeParser::*)()>;
    static const Statements &table();

    void plain_material();
    void full_material();
    void sphere();
    void cone();
    void polygon();
    void patch();
    void mesh();
    void textured_triangle();
    void textured_patch();
    void animated_triangle();

    void finish_material(FileMaterial material);
    void use(const FileMaterial &material);
    uint32_t material();
    int32_t texture(std::string_view file);
    std::array<double, 2> texel();
    std::vector<Double3> vectors(size_t count, std::string_view what);
    void warn(const char *kind, const std::string &text);
    void add_triangles(size_t count);
    void add(Mesh &&mesh);
    void add_polygon(const std::vector<Double3> &corners, const std::vector<Double3> &normals);

    struct Sphere {
        Double3 center;
        double radius;
        size_t mesh;       // its index in the graph
        std::string where; // `FILE:LINE`
    };
    void warn_of_flat_sphere(const std::vector<Place> &places, bool fine);

    SceneTokens &tokens_;
    SceneGraph &graph_;
    std::vector<Sphere> spheres_;
    size_t max_triangles_, triangles_ = 0;
    int32_t node_ = -1;                                    // of the statement
    std::map<std::array<double, 12>, uint32_t> materials_; // index in the graph
    std::map<std::string, int32_t, std::less<>> textures_; // index in the graph
    std::optional<uint32_t> material_;                     // the last one; none yet: the default
};

} // namespace wisp

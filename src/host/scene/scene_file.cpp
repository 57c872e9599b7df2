#include "host/base/error.h"
#include "host/scene/placement.h"
#include "host/base/text.h"
#include "host/images/exr.h"
#include "host/images/picture.h"
#include "host/images/texture_readers.h"
#include "host/scene/scene_file.h"
#include "host/scene/shape_parser.h"
#include <algorithm>
#include <set>

namespace wisp {

namespace {

constexpr size_t max_blocks = 256; // in one another
constexpr int64_t any_level = 1000000000;

// Whole scenes: all but the statements about surfaces.
class SceneParser {
  public:
    SceneParser(const std::string &path, const std::string &text, const FileReader &read, const SceneLimits &limits)
        : tokens_(path, text, read, limits), shapes_(tokens_, scene_.graph, limits.triangles),
          is_nff_(ends_in(path, ".nff")) {}

    SceneFile parse() {
        for (;;) {
            while (!tokens_.at_end()) statement();
            if (!blocks_.empty() && blocks_.back().file == tokens_.depth())
                tokens_.fail("the file ends, expected '}' for the block of line " +
                             std::to_string(blocks_.back().line));
            if (tokens_.depth() == 0) break;
            tokens_.leave();
        }
        shapes_.finish(places());
        if (is_nff_) dim_uncolored_lights();
        return std::move(scene_);
    }

  private:
    // Of the eye and the lights.
    std::vector<ShapeParser::Place> places() const {
        std::vector<ShapeParser::Place> places;
        if (scene_.view) places.push_back({"the eye", scene_.view->from});
        for (const SceneFile::Light &light : scene_.lights)
            if (light.kind != LightKind::parallel) places.push_back({"a light", light.position});
        return places;
    }

    struct Block {
        int32_t node;
        size_t file; // depth of the file that opens it, which has to close it
        int line;
        bool moves, uniform; // it or a block around it is `x`; all scales are uniform and above 0
    };
    using Statements = std::map<std::string_view, void (SceneParser::*)()>;
    static const Statements &table();

    void statement() {
        const std::string_view word = tokens_.take("a statement");
        const auto found = table().find(word);
        if (found != table().end())
            (this->*found->second)();
        else if (!shapes_.parse(word, node()))
            unknown();
    }
    [[noreturn]] void unknown() const {
        std::string names = ShapeParser::statements();
        for (const auto &entry : table()) names.append(entry.first) += ' ';
        tokens_.fail("there is no statement '" + tokens_.last() + "', expected one of " + names + "or a comment" +
                     did_you_mean(tokens_.last(), split(names, ' ')));
    }

    // Blocks.
    int32_t node() const { return blocks_.empty() ? -1 : blocks_.back().node; }
    // The node for what cannot move, and where `turns`, cannot be stretched.
    int32_t static_node(const std::string &what, bool turns) const {
        if (blocks_.empty()) return -1;
        if (blocks_.back().moves) tokens_.fail(what + " is in a block 'x', expected it outside: it does not move");
        if (turns && !blocks_.back().uniform)
            tokens_.fail(what + " is in a block 'xs' whose scales are not equal and above 0, expected uniform scales");
        return blocks_.back().node;
    }
    int32_t add_node(const std::string &name, const Placement &placement) {
        scene_.graph.nodes.push_back({node(), name, placement});
        return static_cast<int32_t>(scene_.graph.nodes.size() - 1);
    }
    void open(const std::string &name, const Placement &placement) {
        const int line = tokens_.line();
        tokens_.keyword("{");
        if (blocks_.size() == max_blocks)
            tokens_.fail("more than " + std::to_string(max_blocks) + " blocks in one another, expected no more");
        const bool moves = !blocks_.empty() && blocks_.back().moves,
                   uniform = blocks_.empty() || blocks_.back().uniform;
        blocks_.push_back({add_node(name, placement), tokens_.depth(), line, moves || !name.empty(),
                           uniform && is_uniform(placement.scale)});
    }
    void static_block() {
        const Placement placement = this->placement();
        open("", placement);
    }
    void moving_block() { open(tokens_.name("the name of a motion"), {}); }
    void close() {
        if (blocks_.empty() || blocks_.back().file != tokens_.depth())
            tokens_.fail("found '}', expected a statement: no block is open in this file");
        blocks_.pop_back();
    }
    static bool is_uniform(const Double3 &scale) { return scale.x > 0 && scale.x == scale.y && scale.y == scale.z; }
    Placement placement() {
        Placement p;
        p.scale = tokens_.vector("the scale");
        if (p.scale.x == 0 || p.scale.y == 0 || p.scale.z == 0) tokens_.fail("found a scale of 0, expected others");
        const Double3 axis = tokens_.vector("the axis");
        p.degrees = tokens_.number("the angle of rotation");
        p.axis = axis_of(axis, p.degrees);
        p.translation = tokens_.vector("the translation");
        return p;
    }
    // Of unit length; any where there is no rotation.
    Double3 axis_of(const Double3 &axis, double degrees) const {
        if (axis.x != 0 || axis.y != 0 || axis.z != 0) return unit(axis);
        if (degrees != 0) tokens_.fail("found axis 0 0 0, expected some length");
        return {0, 0, 1};
    }

    // Motions.
    void motion() {
        const std::string name = tokens_.name("the name of what moves");
        Motion motion;
        tokens_.keyword("{");
        for (std::string kind; (kind = tokens_.take("'}'")) != "}";) {
            if (kind == "transl")
                keys(motion.translation, kind);
            else if (kind == "rot")
                keys(motion.rotation, kind);
            else if (kind == "scale")
                keys(motion.scale, kind);
            else if (kind == "visibility")
                switches(motion.visibility);
            else
                tokens_.fail("there is no '" + kind + "' in a motion, expected transl rot scale visibility or }");
        }
        scene_.graph.motions[name] = std::move(motion);
    }
    void keys(std::vector<Key> &track, const std::string &kind) {
        if (!track.empty()) tokens_.fail("found a second '" + kind + "', expected one in a motion");
        const bool turns = kind == "rot";
        track.resize(tokens_.count("the keys of '" + kind + "'", 4, turns ? 8 : 7));
        for (Key &key : track) {
            key.time = tokens_.number("a key's time");
            key.value = tokens_.vector(turns ? "a key's axis" : "a key");
            key.degrees = turns ? tokens_.number("a key's angle") : 0;
            if (turns) key.value = axis_of(key.value, key.degrees);
            key.tension = tokens_.number("a key's tension");
            key.continuity = tokens_.number("a key's continuity");
            key.bias = tokens_.number("a key's bias");
        }
    }
    void switches(std::vector<Motion::Switch> &track) {
        if (!track.empty()) tokens_.fail("found a second 'visibility', expected one in a motion");
        track.resize(tokens_.count("the keys of 'visibility'", 1, 2));
        for (Motion::Switch &key : track) {
            key.time = tokens_.number("a key's time");
            key.visible = tokens_.integer("whether it is visible", 0, 1) == 1;
        }
    }
    void animation() {
        SceneFile::Animation a;
        a.start = tokens_.number("the time of the first frame");
        a.end = tokens_.number("the time of the last frame");
        a.frames = tokens_.integer("the number of frames", 1, any_level);
        scene_.animation = a;
    }

    // Files.
    void detail() { detail_ = tokens_.integer("the level of detail", -any_level, any_level); }
    void include() {
        const int64_t level = tokens_.integer("the level of detail", -any_level, any_level);
        const std::string file = tokens_.name("a file to include");
        if (level <= detail_) tokens_.include(tokens_.beside(file));
    }

    void view() {
        SceneFile::View view;
        tokens_.keyword("from");
        view.from = tokens_.vector("from");
        tokens_.keyword("at");
        view.at = tokens_.vector("at");
        tokens_.keyword("up");
        view.up = tokens_.direction("up");
        tokens_.keyword("angle");
        view.angle = tokens_.number("the angle of view");
        if (!(view.angle > 0 && view.angle < 180))
            tokens_.fail("found angle " + tokens_.last() + ", expected above 0 and below 180 degrees");
        tokens_.keyword("hither");
        tokens_.number("the distance of the near plane");
        tokens_.keyword("resolution");
        view.width = static_cast<int>(tokens_.integer("the picture's width", 1, 65536));
        view.height = static_cast<int>(tokens_.integer("the picture's height", 1, 65536));
        const Double3 d = view.at - view.from;
        if (d.x == 0 && d.y == 0 && d.z == 0) tokens_.fail("'from' and 'at' are the same point, expected two");
        if (are_parallel(d, view.up)) tokens_.fail("'up' is parallel to the direction of view, expected another");
        // The first of the outermost file counts; those of included files only where it has none.
        if (scene_.view && tokens_.depth() >= view_file_) return;
        scene_.view = view;
        view_file_ = tokens_.depth();
    }
    void background() { scene_.background = tokens_.color("the background"); }

    // Lights.
    void ambient() {
        scene_.ambient = tokens_.color("the ambient light");
        has_ambient_ = true;
    }
    void light() {
        add_constant("", tokens_.vector("the light's position"));
        place_light();
    }
    void named_light() {
        if (!blocks_.empty()) tokens_.fail("found 'la' in a block, expected it outside: its motion is in the world");
        const std::string name = tokens_.name("the light's name");
        add_constant(name, tokens_.vector("the light's position"));
    }
    void add_constant(const std::string &name, const Double3 &position) {
        SceneFile::Light light = {LightKind::constant, position, {}, 0, {1, 1, 1}, name};
        if (tokens_.next_is_number())
            light.color = tokens_.color("the light");
        else
            uncolored_.push_back(scene_.lights.size());
        ++constant_lights_;
        scene_.lights.push_back(light);
    }
    // NFF leaves the intensity of its n lights open, and what is ambient; its text proposes sqrt(n) / (2 n) for both.
    // In any other file they are 1.
    void dim_uncolored_lights() {
        if (constant_lights_ == 0) return;
        const double n = static_cast<double>(constant_lights_), intensity = std::sqrt(n) / (2 * n);
        for (size_t i : uncolored_) scene_.lights[i].color = {intensity, intensity, intensity};
        if (!has_ambient_) scene_.ambient = {intensity, intensity, intensity};
    }
    // The last light, from the space of its block to that of the world.
    void place_light() {
        SceneFile::Light &light = scene_.lights.back();
        const bool turns = light.kind == LightKind::spot || light.kind == LightKind::parallel;
        const int32_t node = static_node("a light", turns);
        light.position = placed_in_world(scene_.graph.nodes, node, light.position);
        light.direction = turned_in_world(scene_.graph.nodes, node, light.direction);
        if (!(largest_component(light.position) <= 1e30))
            tokens_.fail("the blocks move the light beyond +-1e30, expected smaller transforms");
    }
    void point() {
        const Double3 position = tokens_.vector("the light's position");
        scene_.lights.push_back({LightKind::point, position, {}, 0, tokens_.color("the light")});
        place_light();
    }
    void spot() {
        const Double3 position = tokens_.vector("the light's position"),
                      axis = tokens_.direction("the light's direction");
        const double degrees = tokens_.number("the cone's full angle");
        if (!(degrees > 0 && degrees <= 360))
            tokens_.fail("found cone angle " + tokens_.last() + ", expected above 0, at most 360 degrees");
        scene_.lights.push_back({LightKind::spot, position, axis, degrees, tokens_.color("the light")});
        place_light();
    }
    void parallel() {
        const Double3 travels = tokens_.direction("the light's direction");
        scene_.lights.push_back({LightKind::parallel, {}, travels, 0, tokens_.color("the light")});
        place_light();
    }
    void render() {
        const std::string where_it_stands = tokens_.where();
        const std::string option(tokens_.take("an option's name"));
        const std::string value(tokens_.take("a value for '" + option + "'"));
        scene_.defaults.push_back({option, value, where_it_stands});
    }

    void smoke() {
        SceneFile::SmokeVolume smoke;
        const std::string file = tokens_.name("a file of particles, a .vol or 'box'");
        smoke.where = tokens_.where();
        smoke.node = static_node("smoke", true);
        if (file == "box" && tokens_.next_is_number())
            smoke.box = box();
        else
            smoke.file = tokens_.beside(file);
        tokens_.keyword("{");
        std::set<std::string> keys;
        for (std::string key; (key = tokens_.take("'}'")) != "}";) {
            if (!keys.insert(key).second) tokens_.fail("found '" + key + "' again, expected it once in a smoke");
            if (key == "kernel" || key == "radius" || key == "mass") {
                if (smoke.box) tokens_.fail("found '" + key + "', expected none in a box: only particles have it");
                smoke.of_particles = {tokens_.where(), key};
            }
            if (smoke.box && key == "grid") tokens_.fail("found 'grid', expected none in a box: it has no file");
            if (smoke.box && key == "frames") tokens_.fail("found 'frames', expected none in a box: it has no files");
            if (key == "kernel") {
                const std::string name(tokens_.take("spline or poly6"));
                if (name != "spline" && name != "poly6") tokens_.fail("found '" + name + "', expected spline or poly6");
                smoke.kernel = name == "spline" ? Kernel::spline : Kernel::poly6;
            } else if (key == "grid") {
                smoke.grid = tokens_.name("the name of a grid");
            } else if (key == "radius") {
                smoke.radius = tokens_.number_in("a smoothing length above 0", 1e-30, 1e30);
            } else if (key == "mass") {
                smoke.mass = tokens_.number_in("a mass of 0 or more", 0, 1e30);
            } else if (key == "extinction") {
                smoke.extinction = tokens_.number_in("an extinction of 0 or more", 0, 1e30);
            } else if (key == "albedo") {
                smoke.albedo = tokens_.color("the albedo", 1);
            } else if (key == "phase") {
                smoke.phase = tokens_.number("g of the phase function");
                if (!(smoke.phase > -1 && smoke.phase < 1))
                    tokens_.fail("found phase " + tokens_.last() + ", expected above -1 and below 1");
            } else if (key == "emission") {
                smoke.emission = tokens_.color("the emission");
            } else if (key == "transform") {
                const Placement own = placement();
                if (!is_uniform(own.scale))
                    tokens_.fail("the scales are not equal and above 0, expected a uniform scale");
                smoke.node = add_node("", own);
            } else if (key == "frames") {
                smoke.first_frame = tokens_.integer("the first file's number", 0, 1000000000);
                smoke.frame_step = tokens_.integer("the step from frame to frame", -1000000, 1000000);
            } else {
                const std::string names = "grid kernel radius mass extinction albedo phase emission transform frames";
                tokens_.fail("there is no '" + key + "' in smoke, expected " + names + " or }" +
                             did_you_mean(key, split(names, ' ')));
            }
        }
        if (keys.count("frames") && !has_number(smoke.file))
            scene_.graph.warnings.push_back({"frames", smoke.where,
                                             "'frames' does nothing: there is no %04d in the name " + smoke.file +
                                                 ", so each frame shows the same file"});
        scene_.smokes.push_back(smoke);
    }
    SceneFile::Box box() {
        SceneFile::Box box;
        box.low = tokens_.vector("the box's lower corner");
        box.high = tokens_.vector("the box's upper corner");
        if (!(box.low.x < box.high.x && box.low.y < box.high.y && box.low.z < box.high.z))
            tokens_.fail("the box has no volume, expected X0 < X1, Y0 < Y1 and Z0 < Z1");
        box.density = tokens_.number_in("a density of 0 or more", 0, 1e30);
        return box;
    }

    SceneFile scene_;
    SceneTokens tokens_;
    ShapeParser shapes_;
    std::vector<Block> blocks_; // the open ones
    int64_t detail_ = 0;
    size_t view_file_ = 0;          // depth of the file that `view` is from
    std::vector<size_t> uncolored_; // the `l` lights without a colour of their own
    size_t constant_lights_ = 0;
    bool has_ambient_ = false, is_nff_;
};

const SceneParser::Statements &SceneParser::table() {
    static const Statements statements = {
        {"v", &SceneParser::view},      {"b", &SceneParser::background},    {"a", &SceneParser::animation},
        {"am", &SceneParser::ambient},  {"l", &SceneParser::light},         {"la", &SceneParser::named_light},
        {"lp", &SceneParser::point},    {"ls", &SceneParser::spot},         {"ld", &SceneParser::parallel},
        {"smoke", &SceneParser::smoke}, {"render", &SceneParser::render},   {"i", &SceneParser::include},
        {"d", &SceneParser::detail},    {"xs", &SceneParser::static_block}, {"x", &SceneParser::moving_block},
        {"}", &SceneParser::close},     {"k", &SceneParser::motion},
    };
    return statements;
}

} // namespace

std::string SceneFile::SmokeVolume::path(int64_t frame) const {
    return numbered(file, first_frame + frame * frame_step);
}

SceneFile parse_scene(const std::string &path, const std::string &text, const FileReader &read,
                      const SceneLimits &limits) {
    return SceneParser(path, text, read, limits).parse();
}

namespace {

// What a file is that users take for a scene, or "".
std::string other_than_scene(const std::string &path, const Bytes &bytes) {
    const std::string name = lower_case(path);
    if (is_pfm(bytes) || is_exr(bytes) || is_png(bytes) || ends_in(name, ".ppm")) return "a picture";
    for (const char *ending : {".obj", ".stl", ".off", ".gltf", ".glb"})
        if (ends_in(name, ending)) return "a mesh, whose format wisp does not read";
    const std::string line(bytes.begin(), std::find(bytes.begin(), bytes.end(), '\n'));
    return line.rfind("wisp ", 0) == 0 ? "'" + printable(line.substr(0, 32)) + "'" : ""; // a map, passes or a record
}

void require_scene(const std::string &path, const Bytes &bytes, const std::string &expected) {
    const std::string other = other_than_scene(path, bytes);
    if (!other.empty()) throw InputError(path, "found " + other + expected);
}

} // namespace

SceneFile read_scene(const std::string &path) {
    const Bytes bytes = read_file(path);
    const std::string expected = ", expected a scene, particles or a density grid";
    if (bytes.empty()) throw InputError(path, "found an empty file" + expected);
    require_scene(path, bytes, expected);
    std::vector<std::string> included;
    const auto read = [&included](const std::string &file) {
        included.push_back(file);
        Bytes text = read_plain_file(file);
        require_scene(file, text, ", expected statements of a scene");
        return text;
    };
    SceneFile scene = parse_scene(path, std::string(bytes.begin(), bytes.end()), read);
    scene.included = std::move(included);
    return scene;
}

} // namespace wisp

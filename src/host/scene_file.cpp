#include "host/scene_file.h"
#include "host/error.h"
#include "host/files.h"
#include "host/options.h"
#include <cmath>
#include <functional>
#include <map>

namespace wisp {

namespace {

struct Token {
    std::string text;
    int line;
};

// Words between white space; `{` and `}` are words of their own. `#` and `%` start a comment, but for `%04d` inside a
// word or at the start of the one behind `smoke`.
std::vector<Token> split_into_tokens(const std::string &text) {
    std::vector<Token> tokens;
    int line = 1;
    bool open = false; // the last token goes on
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        bool comment = c == '#';
        if (c == '%') {
            size_t next = i + 1;
            while (next < text.size() && text[next] >= '0' && text[next] <= '9') ++next;
            const bool name = open || (!tokens.empty() && tokens.back().text == "smoke");
            comment = !(name && next < text.size() && text[next] == 'd');
        }
        if (comment) {
            while (i + 1 < text.size() && text[i + 1] != '\n') ++i;
            open = false;
        } else if (c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v' || c == '\n') {
            open = false;
            if (c == '\n') ++line;
        } else if (c == '{' || c == '}') {
            tokens.push_back({std::string(1, c), line});
            open = false;
        } else {
            if (!open) tokens.push_back({"", line});
            tokens.back().text += c;
            open = true;
        }
    }
    return tokens;
}

class Parser {
  public:
    Parser(const std::string &path, const std::string &text) : path_(path), tokens_(split_into_tokens(text)) {}

    SceneFile parse() {
        static const std::map<std::string, void (Parser::*)()> statements = {
            {"v", &Parser::view},  {"b", &Parser::background}, {"l", &Parser::light},     {"lp", &Parser::point},
            {"ls", &Parser::spot}, {"ld", &Parser::parallel},  {"smoke", &Parser::smoke}, {"render", &Parser::render},
        };
        static const std::string later = " la f fm c s p pp i d tt ttp tpa x xs am k m a ";
        while (next_ < tokens_.size()) {
            const Token &word = take("a statement");
            const auto statement = statements.find(word.text);
            if (statement != statements.end())
                (this->*statement->second)();
            else if (later.find(' ' + word.text + ' ') != std::string::npos)
                fail("statement '" + word.text +
                     "' is not supported yet by this version, expected v b l lp ls ld smoke or render");
            else
                fail("there is no statement '" + word.text + "', expected v b l lp ls ld smoke or render");
        }
        if (path_.size() > 4 && path_.compare(path_.size() - 4, 4, ".nff") == 0) dim_uncolored_lights();
        return std::move(scene_);
    }

  private:
    // Errors stand at the line of the token that was taken last.
    std::string where() const {
        const int line = tokens_.empty() ? 1 : tokens_[next_ > 0 ? next_ - 1 : 0].line;
        return path_ + ":" + std::to_string(line) + ": ";
    }
    [[noreturn]] void fail(const std::string &text) const { throw InputError(where() + text); }

    const Token &take(const std::string &expected) {
        if (next_ == tokens_.size()) fail("the file ends, expected " + expected);
        return tokens_[next_++];
    }
    double number(const std::string &what) {
        const Token &token = take(what);
        const auto value = to_number(token.text);
        if (!value) fail("found '" + token.text + "', expected a number: " + what);
        if (std::fabs(*value) > 1e30) fail("found '" + token.text + "', expected a number within +-1e30: " + what);
        return *value;
    }
    double number_in(const std::string &what, double low, double high) {
        const double value = number(what);
        if (!(value >= low && value <= high)) fail("found " + tokens_[next_ - 1].text + ", expected " + what);
        return value;
    }
    int64_t integer(const std::string &what, int64_t low, int64_t high) {
        const Token &token = take(what);
        const auto value = to_integer(token.text);
        if (!value || *value < low || *value > high)
            fail("found '" + token.text + "', expected a whole number from " + std::to_string(low) + " to " +
                 std::to_string(high) + ": " + what);
        return *value;
    }
    Double3 vector(const std::string &what) {
        Double3 v;
        v.x = number("x of " + what);
        v.y = number("y of " + what);
        v.z = number("z of " + what);
        return v;
    }
    Double3 direction(const std::string &what) {
        const Double3 v = vector(what);
        if (v.x == 0 && v.y == 0 && v.z == 0) fail("found 0 0 0, expected " + what + " of some length");
        return v;
    }
    Double3 color(const std::string &what, double high = 1e30) {
        const std::string range = high == 1 ? " from 0 to 1" : " of 0 or more";
        Double3 c;
        c.x = number_in("red" + range + " of " + what, 0, high);
        c.y = number_in("green" + range + " of " + what, 0, high);
        c.z = number_in("blue" + range + " of " + what, 0, high);
        return c;
    }
    void keyword(const std::string &word) {
        const Token &token = take("'" + word + "'");
        if (token.text != word) fail("found '" + token.text + "', expected '" + word + "'");
    }
    bool next_is_number() const { return next_ < tokens_.size() && to_number(tokens_[next_].text); }

    void view() {
        SceneFile::View view;
        keyword("from");
        view.from = vector("from");
        keyword("at");
        view.at = vector("at");
        keyword("up");
        view.up = direction("up");
        keyword("angle");
        view.angle = number("the angle of view");
        if (!(view.angle > 0 && view.angle < 180))
            fail("found angle " + tokens_[next_ - 1].text + ", expected above 0 and below 180 degrees");
        keyword("hither");
        number("the distance of the near plane");
        keyword("resolution");
        view.width = static_cast<int>(integer("the picture's width", 1, 65536));
        view.height = static_cast<int>(integer("the picture's height", 1, 65536));
        const Double3 d = {view.at.x - view.from.x, view.at.y - view.from.y, view.at.z - view.from.z}, u = view.up;
        if (d.x == 0 && d.y == 0 && d.z == 0) fail("'from' and 'at' are the same point, expected two");
        const Double3 side = {d.y * u.z - d.z * u.y, d.z * u.x - d.x * u.z, d.x * u.y - d.y * u.x};
        const double d2 = d.x * d.x + d.y * d.y + d.z * d.z, u2 = u.x * u.x + u.y * u.y + u.z * u.z;
        if (!(side.x * side.x + side.y * side.y + side.z * side.z > 1e-20 * d2 * u2))
            fail("'up' is parallel to the direction of view, expected another");
        if (!scene_.view) scene_.view = view;
    }
    void background() { scene_.background = color("the background"); }
    void light() {
        SceneFile::Light light = {LightKind::constant, vector("the light's position"), {}, 0, {1, 1, 1}};
        if (next_is_number())
            light.color = color("the light");
        else
            uncolored_.push_back(scene_.lights.size());
        ++constant_lights_;
        scene_.lights.push_back(light);
    }
    // NFF leaves the intensity of its n lights open; its text proposes sqrt(n) / (2 n). In any other file it is 1.
    void dim_uncolored_lights() {
        const double n = static_cast<double>(constant_lights_), intensity = std::sqrt(n) / (2 * n);
        for (size_t i : uncolored_) scene_.lights[i].color = {intensity, intensity, intensity};
    }
    void point() {
        const Double3 position = vector("the light's position");
        scene_.lights.push_back({LightKind::point, position, {}, 0, color("the light")});
    }
    void spot() {
        const Double3 position = vector("the light's position"), axis = direction("the light's direction");
        const double degrees = number("the cone's full angle");
        if (!(degrees > 0 && degrees <= 360))
            fail("found cone angle " + tokens_[next_ - 1].text + ", expected above 0, at most 360 degrees");
        scene_.lights.push_back({LightKind::spot, position, axis, degrees, color("the light")});
    }
    void parallel() {
        const Double3 travels = direction("the light's direction");
        scene_.lights.push_back({LightKind::parallel, {}, travels, 0, color("the light")});
    }
    void render() {
        const std::string where_it_stands = where();
        const std::string option = take("an option's name").text;
        scene_.defaults.push_back({option, take("a value for '" + option + "'").text, where_it_stands});
    }
    void smoke() {
        SceneFile::Smoke smoke;
        const std::string file = take("a file of particles, a .vol or 'box'").text;
        smoke.where = where();
        if (file == "{" || file == "}") fail("found '" + file + "', expected a file of particles, a .vol or 'box'");
        if (file == "box" && next_is_number()) {
            smoke.box = box();
        } else {
            const size_t slash = path_.rfind('/');
            smoke.file = file[0] == '/' || slash == std::string::npos ? file : path_.substr(0, slash + 1) + file;
        }
        keyword("{");
        for (std::string key = take("'}'").text; key != "}"; key = take("'}'").text) {
            if (key == "kernel" || key == "radius" || key == "mass") {
                if (smoke.box) fail("found '" + key + "', expected none in a box: only particles have it");
                smoke.of_particles = where() + "found '" + key + "'";
            }
            if (smoke.box && key == "frames") fail("found 'frames', expected none in a box: it has no files");
            if (key == "kernel") {
                const std::string name = take("spline or poly6").text;
                if (name != "spline" && name != "poly6") fail("found '" + name + "', expected spline or poly6");
                smoke.kernel = name == "spline" ? Kernel::spline : Kernel::poly6;
            } else if (key == "radius") {
                smoke.radius = number_in("a smoothing length above 0", 1e-30, 1e30);
            } else if (key == "mass") {
                smoke.mass = number_in("a mass of 0 or more", 0, 1e30);
            } else if (key == "extinction") {
                smoke.extinction = number_in("an extinction of 0 or more", 0, 1e30);
            } else if (key == "albedo") {
                smoke.albedo = color("the albedo", 1);
            } else if (key == "phase") {
                smoke.phase = number("g of the phase function");
                if (!(smoke.phase > -1 && smoke.phase < 1))
                    fail("found phase " + tokens_[next_ - 1].text + ", expected above -1 and below 1");
            } else if (key == "emission") {
                smoke.emission = color("the emission");
            } else if (key == "transform") {
                smoke.transform = transform();
            } else if (key == "frames") {
                smoke.first_frame = integer("the first file's number", 0, 1000000000);
                smoke.frame_step = integer("the step from frame to frame", -1000000, 1000000);
            } else {
                fail("there is no '" + key +
                     "' in smoke, expected kernel radius mass extinction albedo phase emission transform frames or }");
            }
        }
        scene_.smokes.push_back(smoke);
    }
    SceneFile::Box box() {
        SceneFile::Box box;
        box.low = vector("the box's lower corner");
        box.high = vector("the box's upper corner");
        if (!(box.low.x < box.high.x && box.low.y < box.high.y && box.low.z < box.high.z))
            fail("the box has no volume, expected X0 < X1, Y0 < Y1 and Z0 < Z1");
        box.density = number_in("a density of 0 or more", 0, 1e30);
        return box;
    }
    SceneFile::Transform transform() {
        SceneFile::Transform t;
        const Double3 scale = vector("the scale");
        if (!(scale.x > 0) || scale.x != scale.y || scale.y != scale.z)
            fail("the scales are not equal and above 0, expected a uniform scale");
        t.scale = scale.x;
        t.axis = vector("the axis");
        t.degrees = number("the angle of rotation");
        if (t.degrees != 0 && t.axis.x == 0 && t.axis.y == 0 && t.axis.z == 0)
            fail("found axis 0 0 0, expected some length");
        t.translation = vector("the translation");
        return t;
    }

    std::string path_;
    std::vector<Token> tokens_;
    size_t next_ = 0;
    SceneFile scene_;
    std::vector<size_t> uncolored_; // the `l` lights without a colour of their own
    size_t constant_lights_ = 0;
};

} // namespace

SceneFile parse_scene(const std::string &path, const std::string &text) { return Parser(path, text).parse(); }

SceneFile read_scene(const std::string &path) {
    const Bytes bytes = read_file(path);
    return parse_scene(path, std::string(bytes.begin(), bytes.end()));
}

} // namespace wisp

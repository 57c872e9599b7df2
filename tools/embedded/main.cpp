// A picture without files, heap, operating system or, in fixed point, floating-point numbers: wisp as a library.
//
// 1. Include wisp/wisp.h; compile all sources below src/core with -DWISP_ARITH=fixed (or f32, f64) and the flags of
//    `run` beside this file. There is nothing to link but what the compiler itself brings.
// 2. A wisp::Scene says what is there, wisp::Settings how it is rendered: plain data. A program with a file system has
//    src/host make them; here scene_source has written them down as C++.
// 3. plan() says how many bytes of memory that takes. Give them to an Arena.
// 4. render() hands on the picture, row by row, and tells an Observer how it gets on.
#include "board.h"
#include "core/numbers/parts.h"
#include "core/numbers/real.h"
#include "portability/compiled_scene.h"
#include "core/numbers/self_test.h"
#include <type_traits>

namespace wisp {
// Made by scene_source. WISP_SCENES is X(NAME) of each, see fixtures/compiled_scenes.txt.
#define X(name) extern const CompiledScene scene_##name;
WISP_SCENES
#undef X
} // namespace wisp

namespace core = wisp::WISP_ARITH;

namespace {

// All memory that wisp uses, but for the stack and a row of the picture. It need not be 0.
constexpr size_t arena_size = size_t{16} << 20;
__attribute__((section(".arena"))) unsigned char arena_memory[arena_size];

constexpr int32_t max_width = 192;
float row_of_picture[3 * max_width]; // red, green, blue of each pixel

// printf would bring a heap and floating-point code.
class Text {
  public:
    Text &operator<<(const char *text) {
        for (; *text && length_ < sizeof text_ - 1; ++text) text_[length_++] = *text;
        text_[length_] = 0;
        return *this;
    }
    Text &operator<<(uint64_t n) {
        char digits[21];
        char *first = digits + sizeof digits - 1;
        *first = 0;
        do *--first = static_cast<char>('0' + n % 10);
        while ((n /= 10) != 0);
        return *this << first;
    }
    const char *text() const { return text_; }
    size_t length() const { return length_; }

  private:
    char text_[128];
    size_t length_ = 0;
};
template <class... Parts> void print_line(const Parts &...parts) {
    Text text;
    (text << ... << parts) << "\n";
    board::print(text.text());
}

// ---- 3. How much memory

wisp::Plan plan; // not on the stack, which is small
wisp::Statistics statistics;

// A function of its own: plan() returns a copy on the stack.
__attribute__((noinline)) void find_plan(const wisp::Scene &scene, const wisp::Settings &settings) {
    plan = core::renderer.plan(scene, settings);
}
void print_plan() {
    for (const wisp::PlanRow &row : plan.rows)
        if (row.bytes > 0) print_line("  plan: ", row.name, " ", row.bytes, " bytes");
    print_line("  plan: all of it ", plan.arena_bytes, " bytes");
}

// ---- The picture

// Written as .pfm: a line of text that says how large it is, then floats, the bottom row first. (A display would want
// bytes: 255 x^(1/2.2) of each float, clamped to 1.)
class PictureFile {
  public:
    PictureFile(const char *name, int32_t width, int32_t height)
        : file_(name), row_bytes_(size_t{3} * sizeof(float) * static_cast<size_t>(width)), height_(height) {
        Text header;
        header << "PF\n" << static_cast<uint64_t>(width) << " " << static_cast<uint64_t>(height) << "\n-1.0\n";
        file_.write(header.text(), header.length());
        header_bytes_ = header.length();
    }
    void write_row(int32_t y, const float *rgb) { // y: from the top
        file_.go_to(header_bytes_ + static_cast<size_t>(height_ - 1 - y) * row_bytes_);
        file_.write(rgb, row_bytes_);
    }
    bool close() { return file_.close(); }

  private:
    board::File file_;
    size_t header_bytes_, row_bytes_;
    int32_t height_;
};

// ---- 4. What render() tells

struct Listener {
    PictureFile &file;
    uint64_t printed; // quarters of the stage that is running
};
// Returning false would stop render(). `context` is the Observer's own.
bool print_progress(void *context, wisp::Stage stage, uint64_t done, uint64_t total) {
    Listener &to = *static_cast<Listener *>(context);
    if (done == 0) to.printed = 0;
    if (done * 4 < to.printed * total) return true;
    print_line("  ", plan[stage].name, " ", done, "/", total);
    ++to.printed;
    return true;
}
bool write_row(void *context, int32_t y, const float *rgb) {
    static_cast<Listener *>(context)->file.write_row(y, rgb);
    return true;
}

// ---- All of it

bool show(const wisp::CompiledScene &compiled, const char *file_name) {
    const int32_t width = compiled.width, height = compiled.height;
    print_line(file_name, ": ", static_cast<uint64_t>(width), " x ", static_cast<uint64_t>(height));
    wisp::Settings settings = compiled.settings;
    // Without proofs a ray is traced for each shadow: the same picture, later.
    if (!wisp::has(wisp::parts::shadow_proofs)) settings.shadows = wisp::ShadowMethod::trace;
    board::begin_stack_peak();
    find_plan(compiled.scene, settings);
    if (plan.missing) {
        print_line("  not in this program: ", plan.missing);
        return true;
    }
    print_plan();
    if (plan.arena_bytes > arena_size || width > max_width) {
        print_line("  too large for this board");
        return false;
    }

    // An arena that begins anew for each picture. For frames of an animation keep a wisp::FrameCache beside it.
    wisp::Arena arena(arena_memory, arena_size);
    statistics = {};
    PictureFile file(file_name, width, height);
    Listener listener = {file, 0};
    wisp::Job job = {compiled.scene, settings, arena, statistics, {&listener, print_progress, write_row},
                     row_of_picture};
    const uint64_t start = board::instructions();
    const wisp::Status status = core::renderer.render(job);
    const uint64_t instructions = board::instructions() - start;
    if (status != wisp::Status::done) {
        print_line("  failed with status ", static_cast<uint64_t>(status));
        return false;
    }

    if (board::stack_peak() == board::stack_size()) {
        print_line("  needs more stack than ", board::stack_size(), " bytes");
        return false;
    }
    print_line("  arena peak ", arena.peak(), " bytes, stack peak ", board::stack_peak(), " bytes");
    print_line("  ", instructions / static_cast<uint64_t>(width * height), " instructions a pixel");
    if (!file.close()) {
        print_line("  cannot write ", file_name);
        return false;
    }
    // Its bits are those of every other machine: `run` compares the file's digest with fixtures/goldens.txt.
    print_line("  written: ", file_name, "  ", WISP_ARITH_NAME, "  ", compiled.name);
    return true;
}

} // namespace

int main() {
    // Whether floats are rounded as IEEE 754 has it. Fixed point need not ask.
    if constexpr (!std::is_same_v<core::Real, wisp::Fixed>)
        if (const char *fault = wisp::arithmetic_fault()) {
            print_line(fault);
            return 1;
        }
#define X(name)                                                                                                        \
    if (!show(wisp::scene_##name, #name ".pfm")) return 1;
    WISP_SCENES
#undef X
    return 0;
}

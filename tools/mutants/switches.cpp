#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace mutant {

unsigned char switches[places];

namespace {

unsigned char reached[places];

struct Setup {
    const char *file = std::getenv("WISP_REACHED");
    Setup() {
        if (file) std::memset(switches, 2, sizeof switches);
        if (const char *mutant = std::getenv("WISP_MUTANT")) switches[std::atoi(mutant) % places] = 1;
    }
    ~Setup() {
        if (!file) return;
        if (FILE *out = std::fopen(file, "a")) {
            // In one piece: a test's programs may end at once.
            std::setvbuf(out, nullptr, _IOFBF, size_t{8} * places);
            for (int i = 0; i < places; ++i)
                if (reached[i]) std::fprintf(out, "%d\n", i);
            std::fclose(out);
        }
    }
} setup;

} // namespace

bool note(int place) {
    if (switches[place] == 1) return true;
    reached[place] = 1;
    switches[place] = 0;
    return false;
}

} // namespace mutant

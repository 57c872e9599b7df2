// A scene about a file of smoke by itself: camera, lights, ground and the smoke's own numbers, chosen from the data.
#pragma once
#include "host/scene/options.h"
#include "host/scene/scene_file.h"
#include <string>
#include <vector>

namespace wisp {

// Whether a file holds particles or a density grid, by its first bytes; of a numbered name, whether it is a sequence.
// A pipe is none, as it can be read only once.
bool is_smoke_file(const std::string &path);

// The scene (README, "A scene about a file"), a function of the data and the options alone.
class ChosenScene {
  public:
    // Reads the file at `path`, or where that is a numbered name all files that are there: each is a frame. Throws
    // InputError for files that cannot be read, and that hold no smoke.
    ChosenScene(const std::string &path, const Options &options);

    // As a scene file that names the file of smoke so. Throws InputError for a name that no scene can have.
    std::string text(const std::string &named) const;
    SceneFile scene() const;

    // Which files of a sequence are no frames, and why; empty: none.
    const std::string &left_out() const { return left_out_; }

  private:
    std::string path_, before_, smoke_, behind_; // the statements before the smoke, in its braces, and behind it
    std::string left_out_;
};

// Chooses what a scene leaves out in the same way: the smoothing length of particles whose file has none, mass and
// extinction where neither the scene nor the file has a mass, the camera where there is smoke. What a sequence shows
// first decides. Returns a line for each, which says what was chosen. Files that cannot be read are left alone, and so
// are pipes.
std::vector<std::string> complete_scene(SceneFile &scene);

} // namespace wisp

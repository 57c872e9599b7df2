// The commands behind `wisp WORD`. `arguments` are the words behind the command's name. Each returns the exit status or
// throws Error.
#pragma once
#include <string>
#include <vector>

namespace wisp {

// `wisp render SCENE`: pictures, one per frame.
int render_command(const std::vector<std::string> &arguments);

// `wisp plan SCENE`: the stages that the scene needs, and their bytes.
int plan_command(const std::vector<std::string> &arguments);

// `wisp inspect SCENE X Y`: how a pixel came to be what it is, as text, with --json as JSON.
int inspect_command(const std::vector<std::string> &arguments);

// `wisp show STAGE SCENE`: a picture of what a stage has made.
int show_command(const std::vector<std::string> &arguments);

// `wisp info FILE`: what a file is and holds, as text, with --json as JSON.
int info_command(const std::vector<std::string> &arguments);

// `wisp compare A B`: prints how picture A differs from B, each a .pfm, .exr or .png; with `--json -` as JSON. Returns
// exit_done when all bits match or, given --tolerance, --max-flip or --max-ulps, when they differ by no more; else
// exit_difference.
int compare_command(const std::vector<std::string> &arguments);

// `wisp merge A.passes B.passes ... -o FILE`: the picture (.png, .pfm, .exr) of all passes together, or their sums
// (.passes); or one .map of the sums of several.
int merge_command(const std::vector<std::string> &arguments);

// `wisp stitch PART ... -o WHOLE`: the picture (.png, .pfm, .exr) of parts (.pfm, .exr) rendered with --crop.
int stitch_command(const std::vector<std::string> &arguments);

// The lines of help on the options that a command has beside those of rendering.
std::string inspect_help();
std::string show_help();
std::string plan_help();
std::string info_help();
std::string compare_help();
std::string merge_help();
std::string stitch_help();

} // namespace wisp

// The words of `--shadows`.
#pragma once
#include "wisp/shadow_methods.h"

namespace wisp {

// By ShadowMethod: the names, and how each finds a shadow; all names as "|trace|cache...".
#define METHOD(name, how) #name,
constexpr const char *shadow_method_names[] = {WISP_SHADOW_METHODS(METHOD)};
#undef METHOD
#define METHOD(name, how) how,
constexpr const char *shadow_method_descriptions[] = {WISP_SHADOW_METHODS(METHOD)};
#undef METHOD
#define METHOD(name, how) "|" #name
constexpr char shadow_method_choices[] = WISP_SHADOW_METHODS(METHOD);
#undef METHOD

} // namespace wisp

// From the settings of a caller to those of the core.
#pragma once
#include "wisp/c_api.h"
#include "wisp/settings.h"

namespace wisp::c_api {

// Refuses numbers that are out of range.
wisp_status check_numbers(const wisp_settings &settings, wisp_error *error);

// Refuses numbers that are out of range, and settings that exclude each other in this frame.
wisp_status read_settings(const wisp_settings *from, const wisp_frame &frame, Settings &settings, wisp_error *error);

} // namespace wisp::c_api

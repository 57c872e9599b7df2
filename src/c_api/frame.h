// What the opaque wisp_frame is: a scene in the core's units. It stands in the caller's memory, before its arrays.
#pragma once
#include "wisp/c_api.h"
#include "wisp/scene.h"

struct wisp_frame {
    wisp::Scene scene;
    uint32_t width, height;
};

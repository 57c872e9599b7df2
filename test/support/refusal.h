// What input is refused with.
#pragma once
#include "host/base/error.h"
#include <string>

// "no error": it is not.
template <class Action> std::string refusal_of(Action &&action) {
    try {
        action();
    } catch (const wisp::InputError &error) {
        return error.what();
    }
    return "no error";
}

// The line that says why a call of the C interface is refused.
#pragma once
#include "host/base/decimal.h"
#include "wisp/c_api.h"

namespace wisp::c_api {

// A line being written, cut where its room ends.
class Line {
  public:
    explicit Line(wisp_error &error) : error_(error) { error_.text[0] = 0; }

    void add(const char *text) {
        for (; *text && size_ + 1 < sizeof error_.text; ++text) error_.text[size_++] = *text;
        error_.text[size_] = 0;
    }
    void add(uint64_t number) { add(Decimal(number).text()); }

  private:
    wisp_error &error_;
    size_t size_ = 0;
};

// Returns `status`, and leaves the parts, texts and whole numbers, as one line, where there is room for it.
template <class... Parts> wisp_status refuse(wisp_error *error, wisp_status status, const Parts &...parts) {
    if (!error) return status;
    Line line(*error);
    (line.add(parts), ...);
    return status;
}

inline wisp_status done(wisp_error *error) { return refuse(error, WISP_DONE); }

// Of the structures that a caller hands in.
inline wisp_status check_version(const char *what, uint32_t version, wisp_error *error) {
    if (version == WISP_C_API_VERSION) return WISP_DONE;
    return refuse(error, WISP_WRONG_USAGE, what, ".version: found ", uint64_t{version}, ", expected ",
                  uint64_t{WISP_C_API_VERSION}, ", the version of the C interface that this library has");
}

} // namespace wisp::c_api

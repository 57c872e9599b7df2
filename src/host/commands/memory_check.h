// Whether a plan fits in memory, and if not, which option makes it fit.
#pragma once
#include "host/commands/request.h"
#include <cstdlib>
#include <memory>

namespace wisp {

// Throws Error(exit_memory) for a plan and a picture that need more than --memory together, or more than the
// `available` bytes. The error names the largest part, and an option with which a new plan fits, if there is one.
void check_memory(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan,
                  uint64_t available);

// The arena's memory. It begins at a cache line, so that what --stats says of its bytes does not depend on the system.
// Not initialised: pages that the core never writes cost nothing.
class Block {
  public:
    // Makes it at least as large as the plan needs, after check_memory(). True: it is another one, and what the one
    // before held is gone.
    bool fit(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan);
    unsigned char *get() const { return memory_.get(); }

  private:
    struct Free {
        void operator()(unsigned char *memory) const { std::free(memory); }
    };
    std::unique_ptr<unsigned char[], Free> memory_;
    uint64_t bytes_ = 0;
};

} // namespace wisp

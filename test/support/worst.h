// The largest of many errors.
#pragma once

namespace wisp {

// The larger of two errors; NaN once an error was NaN, which std::max would lose.
inline double worst_of(double worst, double error) { return worst != worst || error <= worst ? worst : error; }

} // namespace wisp

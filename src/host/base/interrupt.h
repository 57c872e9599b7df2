// Signals that end the process: they are noted, and the work stops at the next point where it can.
#pragma once

namespace wisp {

// From now on the first SIGINT, SIGTERM or SIGHUP is noted; a second one of the same kind ends the process at once. A
// signal that the process ignores (nohup) stays ignored.
void install_signal_handlers();

// The signal that was noted, or 0.
int received_signal();

// Its name.
const char *signal_name(int signal);

} // namespace wisp

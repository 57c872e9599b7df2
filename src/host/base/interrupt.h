// Signals that end the process: they are noted, and the work stops at the next point where it can.
#pragma once

namespace wisp {

// From now on the first SIGINT, SIGTERM or SIGHUP is noted; the same once more ends the process at once. Those that
// are ignored (nohup) stay so.
void install_signal_handlers();

// The signal that was noted, or 0.
int received_signal();

// Its name.
const char *signal_name(int signal);

} // namespace wisp

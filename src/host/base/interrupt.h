// A signal that asks the process to end, heard where the work can be left.
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

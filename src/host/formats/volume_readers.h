// The readers of the single formats of density grids.
#pragma once
#include "host/base/files.h"
#include "host/formats/volume.h"

namespace wisp {

// Mitsuba's VOL.
bool is_vol(const unsigned char *data, size_t size);
Volume parse_vol(const std::string &name, const unsigned char *data, size_t size);

// NanoVDB. `wanted`: the name of the grid; empty: `density`, or the only one that can be smoke.
bool is_nvdb(const unsigned char *data, size_t size);
Volume parse_nvdb(const std::string &name, const unsigned char *data, size_t size, const std::string &wanted);

// OpenVDB, read by a program of its own, as its library does not stand every file: `vdb_to_nvdb`, which lies beside
// this program, or where `make install` puts it. Throws InputError with what to install where it is not there, and with
// the reason where it fails.
bool is_vdb(const unsigned char *data, size_t size);
Bytes nvdb_of_vdb(const std::string &path);

} // namespace wisp

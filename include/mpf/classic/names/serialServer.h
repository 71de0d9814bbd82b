// SPDX-License-Identifier: MIT
// The name of a header of the original MPF: the commands and statuses of serial servers.
#pragma once

#include <mpf/serial_commands.h>

using namespace mpf::serial;  // NOLINT(google-build-using-namespace): names of the manual

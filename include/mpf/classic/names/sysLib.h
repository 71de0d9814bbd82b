// SPDX-License-Identifier: MIT
// The name of a header of vxWorks.
#pragma once

#include <mpf/classic/vxworks.h>

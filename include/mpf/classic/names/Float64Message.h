// SPDX-License-Identifier: MIT
// The name of a header of the original MPF.
#pragma once

#include <mpf/classic.h>

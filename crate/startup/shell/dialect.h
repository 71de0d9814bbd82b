// SPDX-License-Identifier: MIT
// Dialect: the two languages of startup files, and which of them a file is written in.
//
// Each line that only one shell understands is a sign:
//
//   vxWorks   name = value;  ld < file;  /* comment */;  strcpy(...), malloc(...)
//   iocsh     #! in the first line;  < envPaths;  var NAME VALUE;  epicsEnvSet A B;  $(MACRO)
//             outside quotes
//
// The dialect with more signs is that of the file. Without a majority it is that of the file that
// includes it; for the first file, vxWorks, whose language reads the common part of both.
//
// Threads  any.
#pragma once

#include <string_view>

namespace mpf::startup {

enum class Dialect { vxWorks, iocsh };

[[nodiscard]] Dialect detectDialect(std::string_view content, Dialect otherwise);

}  // namespace mpf::startup

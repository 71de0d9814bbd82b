// SPDX-License-Identifier: MIT
#include "base/run_main.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <system_error>

#include "base/print_error.h"
#include "base/standard_descriptors.h"

namespace mpf {
namespace {

// Flushes stdout: only this reports a full disk. Returns the exit status.
int flushOutput(std::string_view program, int status) noexcept {
  const bool hadFailed = std::ferror(stdout) != 0;
  errno = 0;
  if (std::fflush(stdout) == 0 && !hadFailed) return status;
  printError("{}: standard output: not everything could be written{}{}\n", program,
             errno == 0 ? "" : ": ", errno == 0 ? "" : std::strerror(errno));
  return status == 0 ? kExitFailed : status;
}

// Returns the prefix for an exception of fmt::print() or of a stream, whose text does not name the
// file that could not be written.
const char* placeOf(const std::exception& error) noexcept {
  const bool isOfOutput =
      std::ferror(stdout) != 0 && dynamic_cast<const std::system_error*>(&error) != nullptr;
  return isOfOutput ? "standard output: " : "";
}

}  // namespace

int runMain(const std::string& program, const std::function<int()>& work) noexcept {
  openStandardDescriptors();
  try {
    return flushOutput(program, work());
  } catch (const std::invalid_argument& error) {
    printError("{}: {}\n", program, error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    printError("{}: {}{}\n", program, placeOf(error), error.what());
  } catch (...) {
    printError("{}: failed with an unknown exception\n", program);
  }
  return kExitFailed;
}

}  // namespace mpf

// SPDX-License-Identifier: MIT
// The exceptions of the backplane. Each text names the object and says why; all derive from std::runtime_error.
#pragma once

#include <stdexcept>

namespace mpf {

// Another process serves this name at this location, or has a client window of this incarnation.
class NameInUse : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A file in shared memory that this program cannot use: not created by MPF, truncated, or of another layout version.
class SegmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A segment whose layout version this program does not support.
class VersionError : public SegmentError {
 public:
  using SegmentError::SegmentError;
};

}  // namespace mpf

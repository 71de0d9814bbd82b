// SPDX-License-Identifier: MIT
// The exceptions of the backplane. Each text names the file and the reason. All of them derive from
// std::runtime_error.
//
//   std::runtime_error ─┬─ NameInUse
//                       └─ SegmentError ── VersionError
//
// The constructors of clients and servers throw them; sending and receiving messages does not.
// Failures of the system, such as no memory or no permission, are std::system_error.
#pragma once

#include <stdexcept>

#include <mpf/detail/cpp20.h>

namespace mpf {

// Another process uses this name: in most cases it runs a server of the same name at the same
// location. Stop that process, or choose another name, location or backplane.
class NameInUse : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A file in /dev/shm has a name of MPF but is not a usable segment: it was not created by MPF, is
// truncated, or contains invalid values. Remove the file if no program uses it.
class SegmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The major layout version of a segment is not supported by this program: another version of MPF
// created it. Use the same major layout version in all processes of a backplane.
class VersionError : public SegmentError {
 public:
  using SegmentError::SegmentError;
};

}  // namespace mpf

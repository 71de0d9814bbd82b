// SPDX-License-Identifier: MIT
// DeadServer: a server that was killed and whose window is still locked, by a child that it made
// with a bare clone(), without the handlers of fork(). The child ends with this object.
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "shm/window.h"
#include "tests/shm/child.h"

namespace mpf::test {

class DeadServer {
 public:
  //   window   file name of its window, of a server at location 0
  DeadServer(const std::string& backplane, const std::string& window)
      : server_([&](Child::Self& self) { run(self, backplane, window); }) {
    ::kill(server_.pid(), SIGKILL);
    siginfo_t ended{};
    ::waitid(P_PID, static_cast<id_t>(server_.pid()), &ended, WEXITED | WNOWAIT);
  }
  ~DeadServer() { server_.go(); }
  DeadServer(const DeadServer&) = delete;
  DeadServer& operator=(const DeadServer&) = delete;

 private:
  static void run(Child::Self& self, const std::string& backplane, const std::string& window) {
    const OwnWindow own(
        backplane, layout::SegmentKind::serverWindow, window, {},
        [&](layout::SegmentHeader& header) {
          window.substr(window.rfind('.') + 1).copy(header.name.data(), header.name.size() - 1);
        });
    const auto child = ::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0);
    if (child < 0) ::_exit(1);
    if (child == 0) {
      ::prctl(PR_SET_PDEATHSIG, 0);
      self.ready();  // until the destructor
      ::_exit(0);
    }
    ::pause();
  }
  Child server_;
};

}  // namespace mpf::test

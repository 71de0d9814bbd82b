// SPDX-License-Identifier: MIT
#include "base/program_beside.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/print_error.h"

namespace mpf {

std::string programBeside(const std::string& name) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

int executeProgram(const std::string& name, std::vector<std::string> arguments,
                   const std::string& remedy) {
  const auto program = programBeside(name);
  arguments.insert(arguments.begin(), program);
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (auto& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  ::execv(program.c_str(), pointers.data());
  const auto error = errno;
  if (error == ENOENT) ::execvp(name.c_str(), pointers.data());
  printError("cannot start {}: {}{}; {}\n", program, std::strerror(error),
             error == ENOENT ? ", nor in PATH" : "", remedy);
  return 1;
}

}  // namespace mpf

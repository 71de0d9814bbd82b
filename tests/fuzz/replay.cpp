// SPDX-License-Identifier: MIT
// replay FOLDER MUTATIONS: runs each file of the folder as an input, and so many mutations of it.
// MPF_TEST_SEED repeats the mutations of an earlier run.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/watchdog.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace mpf::test {
namespace {

using Input = std::vector<std::uint8_t>;

constexpr std::size_t kBlock = 12;  // the size of an operation (hostile_files.h)

std::vector<std::filesystem::path> filesOf(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

Input contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(Input& input, std::size_t at, std::uint64_t value, std::size_t bytes) {
  for (; bytes > 0 && at < input.size(); --bytes, value >>= 8)
    input[at++] = static_cast<std::uint8_t>(value);
}

void mutateOnce(Input& input, Random& random) {
  const auto block = random.below(input.size() / kBlock + 1) * kBlock;
  switch (random.below(5)) {
    case 0:
      put(input, random.below(input.size() + 1), random.bits(), 1);
      break;
    case 1:
      put(input, block + 4, random.nasty(), 8);
      break;
    case 2:  // insert a copy of the last block
      input.insert(input.begin() + static_cast<std::ptrdiff_t>(block), kBlock, 0);
      std::copy_n(input.end() - kBlock, kBlock, input.begin() + static_cast<std::ptrdiff_t>(block));
      break;
    case 3:
      input.resize(random.below(input.size() + 1));
      break;
    default:
      put(input, block, random.bits(), kBlock);
  }
}

void feed(const Input& input) {
  static_cast<void>(LLVMFuzzerTestOneInput(input.data(), input.size()));
}

void replay(const std::filesystem::path& file, int mutations, Random& random) {
  const Watchdog watchdog(file.string());
  // After a crash, the last line names the file.
  std::cout << file.filename().string() << std::endl;
  const auto input = contentOf(file);
  feed(input);
  for (int i = 0; i < mutations; ++i) {
    auto mutated = input;
    for (auto times = random.below(4) + 1; times > 0; --times) mutateOnce(mutated, random);
    feed(mutated);
  }
}

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " FOLDER MUTATIONS\n";
    return 2;
  }
  mpf::test::Random random;
  const auto files = mpf::test::filesOf(argv[1]);
  for (const auto& file : files) mpf::test::replay(file, std::atoi(argv[2]), random);
  return files.empty() ? 1 : 0;
}

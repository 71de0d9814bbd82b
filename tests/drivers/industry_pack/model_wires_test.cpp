// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/model_wires.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <vector>

#include <mpf/file_descriptor.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class ModelWiresTest : public testing::Test {
 protected:
  void expectRefused(const std::string& words) const {
    EXPECT_THAT([&] { const ModelWires wires(path_); },
                ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(path_), HasSubstr(words))));
  }
  // Overwrites bytes of the file.
  void damage(std::streamoff at, const std::string& bytes) const {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(at);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  Watchdog watchdog_{"model wires test"};
  TemporaryFolder folder_;
  std::string path_ = folder_.file("wires");
};

TEST_F(ModelWiresTest, AFileThatAStoppedProcessHasLockedIsRefused) {
  const ModelWires wires(path_);
  const FileDescriptor stopped(::open(path_.c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_EQ(::flock(stopped.get(), LOCK_EX), 0);

  expectRefused("locked by another process");
}

TEST_F(ModelWiresTest, CarryValuesBetweenObjectsByName) {
  ModelWires one(path_);
  ModelWires other(path_);
  const auto output = one.wire("dac.0");
  EXPECT_EQ(other.wire("dac.0").get(), 0.0);

  output.set(-2.5);
  one.wire("dio.5").set(5);

  EXPECT_EQ(other.wire("dac.0").get(), -2.5);
  EXPECT_EQ(other.wire("dac.1").get(), 0.0);
  EXPECT_EQ(other.wire("dio.5").get(), 5);
}

TEST_F(ModelWiresTest, KeepTheirValuesWithoutAProcess) {
  {
    ModelWires(path_).wire("dac.7").set(10);
  }
  EXPECT_EQ(ModelWires(path_).wire("dac.7").get(), 10);
}

TEST_F(ModelWiresTest, ReachAnotherProcess) {
  std::array<int, 2> go{};
  ASSERT_EQ(::pipe(go.data()), 0);
  const auto child = ::fork();  // while the process has one thread
  if (child == 0) {
    char byte = 0;
    if (::read(go[0], &byte, 1) == 1) ModelWires(path_).wire("there").set(42);
    ::_exit(0);
  }
  ModelWires wires(path_);
  const auto here = wires.wire("there");
  std::binary_semaphore heard(0);
  const ModelWireWatcher watcher(wires, [&] { heard.release(); });

  ASSERT_EQ(::write(go[1], "!", 1), 1);
  heard.acquire();

  EXPECT_EQ(here.get(), 42);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  for (const auto end : go) ::close(end);
}

TEST_F(ModelWiresTest, DoNotNotifyWhenTheValueIsUnchanged) {
  ModelWires wires(path_);
  const auto wire = wires.wire("dac.0");
  // The number of changes in the file, at which the watchers wait.
  const auto changes = [&] {
    std::ifstream file(path_, std::ios::binary);
    std::uint32_t count = 0;
    file.seekg(16).read(reinterpret_cast<char*>(&count), sizeof count);
    return count;
  };
  const auto before = changes();
  wire.set(1);
  EXPECT_EQ(changes(), before + 1);

  wire.set(1);

  EXPECT_EQ(changes(), before + 1);
}

// When many processes create the file at once, all have the same wires, and each name is one wire.
TEST_F(ModelWiresTest, AreCreatedOnceByManyThreadsAtATime) {
  for (int round = 0; round < 20; ++round) {
    std::filesystem::remove(path_);
    {
      std::vector<std::jthread> makers;
      for (int maker = 0; maker < 8; ++maker) {
        makers.emplace_back([&, maker] {
          ModelWires wires(path_);
          for (int i = 0; i < 16; ++i) {
            const auto name = "w." + std::to_string((i + maker) % 16);
            wires.wire(name).set(wires.wire(name).get() == 0 ? i + 1 : wires.wire(name).get());
          }
        });
      }
    }
    ModelWires wires(path_);
    for (int i = 0; i < 16; ++i) EXPECT_NE(wires.wire("w." + std::to_string(i)).get(), 0);
    for (int i = 16; i < 1024; ++i)
      EXPECT_NO_THROW(static_cast<void>(wires.wire("w." + std::to_string(i))));
    EXPECT_THAT([&] { static_cast<void>(wires.wire("one more")); },
                testing::Throws<std::invalid_argument>());
    EXPECT_THAT([&] { static_cast<void>(wires.wire("one.more")); },
                ThrowsMessage<std::runtime_error>(HasSubstr("1024 wires")));
  }
}

TEST_F(ModelWiresTest, CompleteAFileWhoseCreatorWasKilled) {
  {
    const ModelWires wires(path_);
  }
  damage(0, std::string(64, '\0'));

  EXPECT_EQ(ModelWires(path_).wire("dac.0").get(), 0);
}

TEST_F(ModelWiresTest, ReuseAnEntryWithAnIncompleteName) {
  {
    static_cast<void>(ModelWires(path_).wire("first"));
  }
  damage(64 + 64 + 4, "half a na");

  ModelWires wires(path_);
  wires.wire("me").set(3);
  EXPECT_EQ(ModelWires(path_).wire("me").get(), 3);
  EXPECT_EQ(wires.wire("first").get(), 0);
}

TEST_F(ModelWiresTest, RefuseAFileWithOtherContents) {
  folder_.write("wires", "a letter");
  expectRefused("it has 8 bytes, not 65600; remove it or name another file");
  folder_.write("wires", std::string(65600, 'x'));
  expectRefused("its contents are invalid");
}

TEST_F(ModelWiresTest, RefuseADamagedFile) {
  {
    static_cast<void>(ModelWires(path_).wire("first"));
  }
  damage(8, std::string("\2\0\0\0", 4));
  expectRefused("its version is 2, not 1");
  damage(8, std::string("\1\0\0\0\1", 5));
  expectRefused("its capacity is 1025 wires");
  damage(12, std::string("\0\4\0\0", 4));
  {
    const ModelWires wires(path_);
  }
  damage(64 + 4, std::string(44, 'n'));
  expectRefused("wire 0 has a damaged name");
}

TEST_F(ModelWiresTest, RefuseAFolderAndAnInvalidPath) {
  EXPECT_THROW(const ModelWires wires(folder_.path().string()), std::system_error);
  EXPECT_THROW(const ModelWires wires(folder_.file("no/folder")), std::system_error);
}

TEST_F(ModelWiresTest, RefuseInvalidNames) {
  ModelWires wires(path_);
  for (const auto& name :
       {std::string(), std::string(44, 'n'), std::string("a b"), std::string("a\n")})
    EXPECT_THROW(static_cast<void>(wires.wire(name)), std::invalid_argument);
  EXPECT_NO_THROW(static_cast<void>(wires.wire(std::string(43, 'n'))));
}

}  // namespace
}  // namespace mpf::test

// SPDX-License-Identifier: MIT
// An invalid file has the name of a window: clients and servers report what it is, and continue
// when it has been removed.
#include <fcntl.h>
#include <sys/fsuid.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "base/system_call.h"
#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

void writeFile(const std::string& path, const void* bytes, std::size_t size) {
  std::ofstream(path, std::ios::binary)
      .write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
}

// The window of a dead owner, with one field changed.
void writeWindow(const std::string& path, const std::function<void(layout::SegmentHeader&)>& change,
                 std::size_t size = layout::kWindowBytes) {
  std::vector<std::byte> bytes(layout::kWindowBytes);
  auto& header = *reinterpret_cast<layout::SegmentHeader*>(bytes.data());
  header.magic = layout::kMagic;
  header.layoutMajor = layout::kMajor;
  header.kind = layout::SegmentKind::serverWindow;
  header.totalBytes = layout::kWindowBytes;
  header.incarnation = 77;
  change(header);
  writeFile(path, bytes.data(), size);
}

struct Foreign {
  const char* name;
  const char* saying;  // part of the reason
  std::function<void(const std::string& path)> put;

  friend std::ostream& operator<<(std::ostream& out, const Foreign& foreign) {
    return out << foreign.name;
  }
};

class ForeignWindow : public ClientTest, public testing::WithParamInterface<Foreign> {
 protected:
  ForeignWindow()
      : path_(segments::path(SegmentName::serverWindow(backplane_.name(), 0, "device[0]/a"))) {}
  void TearDown() override {
    std::filesystem::remove(path_);
    ClientTest::TearDown();
  }
  std::string path_;
};

TEST_P(ForeignWindow, IsReportedByTheClientWhichConnectsOnceItIsRemoved) {
  GetParam().put(path_);

  client_.bind("device[0]/a", 0);

  EXPECT_THAT(client_.notConnectedBecause(),
              testing::AllOf(testing::HasSubstr(path_), testing::HasSubstr(GetParam().saying)));
  EXPECT_FALSE(client_.connectWait(1ms));
  std::filesystem::remove(path_);
  startServer({.location = 0});
  runUntil([&] { return client_.isConnected(); });
  EXPECT_EQ(client_.notConnectedBecause(), "");
}

TEST_P(ForeignWindow, IsReportedToAServerOfTheSameName) {
  GetParam().put(path_);

  try {
    startServer({.location = 0});
    FAIL() << "the server replaced a file that is not the window of a dead server";
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr(path_), testing::HasSubstr(GetParam().saying),
                               testing::HasSubstr("remove")));
  }

  EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(path_)))
      << "the server must not remove it";
  EXPECT_THAT(backplane_.removeDead(),
              testing::Not(testing::Contains(std::filesystem::path(path_).filename())));
  std::filesystem::remove(path_);
  EXPECT_NO_THROW(startServer({.location = 0}));
}

const Foreign kForeigners[] = {
    {"NewerLayout", "layout version 9; this program supports 1; restart",
     [](const std::string& path) {
       writeWindow(path, [](layout::SegmentHeader& header) { header.layoutMajor = 9; });
     }},
    {"OlderLayout", "layout version 0; this program supports 1; restart",
     [](const std::string& path) {
       writeWindow(path, [](layout::SegmentHeader& header) { header.layoutMajor = 0; });
     }},
    {"ForeignMagic", "wrong magic number",
     [](const std::string& path) {
       writeWindow(path, [](layout::SegmentHeader& header) { header.magic = 0x1234; });
     }},
    {"CutInItsHeader", "truncated",
     [](const std::string& path) { writeWindow(path, [](layout::SegmentHeader&) {}, 100); }},
    {"CutBehindItsHeader", "truncated",
     [](const std::string& path) {
       writeWindow(path, [](layout::SegmentHeader&) {}, layout::kWindowBytes - 1);
     }},
    {"Empty", "truncated", [](const std::string& path) { writeFile(path, "", 0); }},
    {"Directory", "not a regular file",
     [](const std::string& path) { std::filesystem::create_directory(path); }},
    {"Fifo", "not a regular file",
     [](const std::string& path) { checkCall(::mkfifo(path.c_str(), 0600), "mkfifo", path); }},
    {"SymbolicLink", "Too many levels of symbolic links",
     [](const std::string& path) { std::filesystem::create_symlink("/dev/null", path); }},
};
INSTANTIATE_TEST_SUITE_P(OfEachKind, ForeignWindow, testing::ValuesIn(kForeigners),
                         [](const auto& parameter) { return parameter.param.name; });

class JunkTest : public ClientTest {
 protected:
  void TearDown() override {
    server_.reset();
    for (const auto& name : backplane_.segmentNames()) {
      if (name.find(".77") != std::string::npos) std::filesystem::remove(segments::path(name));
    }
    ClientTest::TearDown();
  }
  // The path of a file that is named with the number 77.
  std::string junk(NameKind kind) const {
    return segments::path(SegmentName::keyed(backplane_.name(), kind, 0x77));
  }
};

// Its header is valid, but the file is too small for a window.
TEST_F(JunkTest, AClientReportsAWindowThatIsTooSmall) {
  const auto path = segments::path(SegmentName::serverWindow(backplane_.name(), 0, "device[0]/a"));
  writeWindow(path, [](layout::SegmentHeader& header) { header.totalBytes = 1000; }, 1000);

  client_.bind("device[0]/a", 0);

  EXPECT_EQ(client_.notConnectedBecause(), path + ": truncated");
  std::filesystem::remove(path);
}

TEST_F(JunkTest, AClientReportsTruncatedHintsOfAServer) {
  const auto& server = startServer({.location = 0});
  const auto window =
      PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, server.getName()),
                          layout::SegmentKind::serverWindow);
  const auto hints = segments::path(
      SegmentName::keyed(backplane_.name(), NameKind::hints, window->header().incarnation));
  std::filesystem::rename(hints, junk(NameKind::hints));
  writeFile(hints, "", 0);

  client_.bind("device[0]/a", 0);

  EXPECT_THAT(client_.notConnectedBecause(),
              testing::AllOf(testing::HasSubstr(hints), testing::HasSubstr("truncated")));
  std::filesystem::rename(junk(NameKind::hints), hints);
  runUntil([&] { return client_.isConnected(); });
}

// Invalid links of every kind: the server counts them, and continues to serve valid links.
TEST_F(JunkTest, InvalidLinksDoNotKeepAServerFromItsClients) {
  auto& server = startServer({.location = 0});
  server.on<Int32>([](Int32&) {});
  bind();
  const auto window =
      PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, server.getName()),
                          layout::SegmentKind::serverWindow);
  const auto link = [&](std::uint64_t number) {
    return segments::path(
        SegmentName::link(backplane_.name(), window->header().incarnation, number));
  };
  writeFile(link(0x771), "", 0);
  writeFile(link(0x772), "a text of some length", 21);
  writeWindow(link(0x773), [](layout::SegmentHeader&) {});
  writeWindow(link(0x774),
              [](layout::SegmentHeader& header) { header.kind = layout::SegmentKind::link; });
  writeWindow(link(0x775), [&](layout::SegmentHeader& header) {
    header.kind = layout::SegmentKind::link;
    header.serverWindow = window->header().incarnation;
    header.queueSlots = header.replySlots = header.queueSize = UINT32_MAX;
  });
  std::filesystem::create_directory(link(0x776));
  checkCall(::mkfifo(link(0x777).c_str(), 0600), "mkfifo");

  // More knocks than the window has room for: the server also searches links by name.
  for (std::uint64_t number = 0x770; number < 0x770 + 200; ++number) window->knock(number);
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(client_.send(Int32Message({.value = i})), SendResult::sent);
    EXPECT_EQ(next().tryAs<Int32>()->value, i);
  }
  Dispatcher dispatcher(backplane_);
  MessageClient later(dispatcher, [](const Message&) {});
  later.bind("device[0]/a", 0);
  runUntil([&] {
    dispatcher.runOnce(Deadline::atNs(0));
    return later.isConnected();
  });

  EXPECT_GE(window->control().protocolErrors.load(), 7u);
  EXPECT_TRUE(client_.isConnected());
}

// A client died while it knocked, and its window was removed: only the server can find the link.
TEST_F(JunkTest, AServerRemovesALinkWhoseClientIsDead) {
  startServer({.location = 0});
  auto dead = std::make_unique<MessageClient>(dispatcher_, [](const Message&) {});
  dead->bind("device[0]/a", 0);
  runUntil([&] { return dead->isConnected(); });
  const auto window =
      PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, "device[0]/a"),
                          layout::SegmentKind::serverWindow);
  const auto name =
      segments::list(SegmentName::linkPrefix(backplane_.name(), window->header().incarnation))
          .at(0);
  std::filesystem::copy_file(segments::path(name), junk(NameKind::link));
  dead.reset();
  runUntil([&] { return window->control().linksClosed.load() == 1; });
  const FileDescriptor image(::open(junk(NameKind::link).c_str(), O_WRONLY | O_CLOEXEC));
  const std::uint64_t nobody = 0x77;
  checkCall(
      ::pwrite(image.get(), &nobody, sizeof nobody, offsetof(layout::SegmentHeader, clientWindow)),
      "pwrite");
  std::filesystem::rename(junk(NameKind::link), segments::path(name));

  window->knock(SegmentName::tryParse(name)->incarnation);

  runUntil([&] { return !std::filesystem::exists(segments::path(name)); });
}

TEST_F(JunkTest, AttachRemovesUnusableFilesAndKeepsThoseOfOtherLayouts) {
  const auto link = [&](std::uint64_t number) {
    return SegmentName::link(backplane_.name(), 0x77, number);
  };
  writeFile(segments::path(link(0x771)), "", 0);
  writeWindow(segments::path(link(0x772)), [](layout::SegmentHeader& header) {
    header.kind = layout::SegmentKind::link;
    header.layoutMajor = 9;
  });
  checkCall(::mkfifo(segments::path(link(0x773)).c_str(), 0600), "mkfifo");
  std::filesystem::create_directory(segments::path(link(0x774)));

  const auto removed = backplane_.removeDead();

  EXPECT_THAT(removed, testing::IsSupersetOf({link(0x771), link(0x773)}));
  EXPECT_THAT(backplane_.segmentNames(), testing::IsSupersetOf({link(0x772), link(0x774)}))
      << "a program of another version may use it";
}

// While this object exists, the files of its thread belong to another user who is not root.
class AsNobody {
 public:
  AsNobody() { ::setfsuid(65534); }
  ~AsNobody() { ::setfsuid(::geteuid()); }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
};

class WindowOfAnotherUser : public ClientTest {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can play two users";
  }
  void TearDown() override {
    std::filesystem::remove(path_);
    ClientTest::TearDown();
  }
  std::string path_ =
      segments::path(SegmentName::serverWindow(backplane_.name(), 0, "device[0]/a"));
};

TEST_F(WindowOfAnotherUser, ThatCannotBeReadIsReportedByTheClient) {
  writeWindow(path_, [](layout::SegmentHeader&) {});
  ASSERT_EQ(::chmod(path_.c_str(), 0600), 0);
  {
    const AsNobody nobody;

    client_.bind("device[0]/a", 0);

    EXPECT_THAT(client_.notConnectedBecause(),
                testing::AllOf(testing::HasSubstr(path_), testing::HasSubstr("Permission denied")));
  }
  std::filesystem::remove(path_);
  startServer({.location = 0});
  runUntil([&] { return client_.isConnected(); });
}

TEST_F(WindowOfAnotherUser, ThatCannotBeRemovedIsReportedToTheServer) {
  writeWindow(path_, [](layout::SegmentHeader&) {});
  for (const mode_t mode : {0600u, 0644u, 0666u}) {
    ASSERT_EQ(::chmod(path_.c_str(), mode), 0);
    const AsNobody nobody;

    try {
      const MessageServer server(backplane_, "device[0]/a", {.location = 0});
      FAIL() << "the server replaced the window of another user";
    } catch (const std::exception& error) {
      // A window that cannot be read may be in use.
      EXPECT_THAT(error.what(),
                  testing::AllOf(testing::HasSubstr(path_),
                                 testing::HasSubstr(mode == 0600 ? "only that user can tell whether"
                                                                 : "remove")));
    }
  }
}

}  // namespace
}  // namespace mpf::test

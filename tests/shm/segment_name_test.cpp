// SPDX-License-Identifier: MIT
// SegmentName: builds, parses and refuses names in /dev/shm.
#include <set>

#include "base/printable.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

TEST(SegmentName, ParsesEachKindOfNameThatItBuilds) {
  constexpr std::uint64_t kWindow = 0xfedc'ba98'7654'3210;
  constexpr std::uint64_t kKey = 0x12;

  const auto window = SegmentName::tryParse(SegmentName::serverWindow("crate-1", -7, "serial[0]"));
  const auto link = SegmentName::tryParse(SegmentName::link("crate-1", kWindow, kKey));
  const auto bulk = SegmentName::tryParse(SegmentName::bulk("crate-1", kKey, 1, 255));
  const auto fanOut = SegmentName::tryParse(SegmentName::fanOut("crate-1", kWindow, 4294967295));

  ASSERT_TRUE(window && link && bulk && fanOut);
  EXPECT_EQ(fanOut->kind, NameKind::fanOut);
  EXPECT_EQ(fanOut->incarnation, kWindow) << "a chunk has the incarnation of its server";
  EXPECT_EQ(window->backplane, "crate-1");
  EXPECT_EQ(window->kind, NameKind::serverWindow);
  EXPECT_EQ(link->kind, NameKind::link);
  EXPECT_EQ(link->serverWindow, kWindow);
  EXPECT_EQ(link->incarnation, kKey);
  EXPECT_EQ(bulk->kind, NameKind::bulk);
  EXPECT_EQ(bulk->incarnation, kKey) << "a bulk segment has the incarnation of its link";
  EXPECT_EQ(bulk->side, 1u);
  EXPECT_EQ(bulk->segment, 255u);
  for (const auto kind :
       {NameKind::clientWindow, NameKind::hints, NameKind::pendingBind, NameKind::fifo}) {
    const auto keyed = SegmentName::tryParse(SegmentName::keyed("crate-1", kind, kWindow));
    ASSERT_TRUE(keyed);
    EXPECT_EQ(keyed->kind, kind);
    EXPECT_EQ(keyed->incarnation, kWindow);
    EXPECT_EQ(keyed->backplane, "crate-1");
  }
}

TEST(SegmentName, HasTheDocumentedFormat) {
  EXPECT_EQ(SegmentName::serverWindow("default", 0, "serial[0]"), "mpf.default.s.0.serial[0]");
  EXPECT_EQ(SegmentName::serverWindow("default", -1, "AIM1/1.a b%"),
            "mpf.default.s.-1.AIM1%2F1%2Ea%20b%25");
  EXPECT_EQ(SegmentName::keyed("default", NameKind::hints, 0xab), "mpf.default.h.ab");
  EXPECT_EQ(SegmentName::link("default", 0xab, 0xcd), "mpf.default.l.ab.cd");
  EXPECT_EQ(SegmentName::bulk("default", 0xcd, 1, 10), "mpf.default.b.cd.1.10");
  EXPECT_EQ(SegmentName::linkPrefix("default", 0xab), "mpf.default.l.ab.");
  EXPECT_EQ(SegmentName::fanOut("default", 0xab, 10), "mpf.default.p.ab.10");
  EXPECT_EQ(SegmentName::fanOutPrefix("default", 0xab), "mpf.default.p.ab.");
  EXPECT_EQ(SegmentName::prefix("default"), "mpf.default.");
  EXPECT_EQ(SegmentName::prefix(""), "mpf.");
}

TEST(SegmentName, DifferentServersHaveDifferentNames) {
  std::set<std::string> files;
  const std::vector<std::string> servers{"a.b",      "a%2Eb", "a%b", "a/b", "a b", "A.b", "a..b",
                                         "\xc3\xa9", "[",     "%",   "%%",  "..",  "."};

  for (const auto& server : servers) {
    const auto file = SegmentName::serverWindow("default", 0, server);
    EXPECT_EQ(file.find('/'), std::string::npos) << file;
    EXPECT_TRUE(SegmentName::tryParse(file)) << file;
    files.insert(file);
  }

  EXPECT_EQ(files.size(), servers.size());
}

TEST(SegmentName, TheLongestNamesFitAFileName) {
  const std::string backplane(layout::kBackplaneChars - 1, 'b');
  const std::string server(layout::kNameChars - 1, '.');
  SegmentName::checkBackplane(backplane);
  SegmentName::checkServer(server);

  EXPECT_LE(SegmentName::serverWindow(backplane, INT32_MIN, server).size(), 255u);
  EXPECT_LE(SegmentName::bulk(backplane, UINT64_MAX, 1, UINT32_MAX).size(), 255u);
  EXPECT_LE(SegmentName::link(backplane, UINT64_MAX, UINT64_MAX).size(), 255u);
}

TEST(SegmentName, RefusesAnInvalidBackplaneNameAndNamesIt) {
  for (const std::string wrong : {"a.b", "a/b", "../x", "a b", "\xc3\xa9", "a\n", "[0]",
                                  "012345678901234567890123456789012345678-"}) {
    const auto why = whatOf<std::invalid_argument>([&] { SegmentName::checkBackplane(wrong); });
    EXPECT_THAT(why, testing::HasSubstr("\"" + printable(wrong) + "\""));
  }
  EXPECT_THAT(whatOf<std::invalid_argument>(
                  [] { SegmentName::checkBackplane(std::string_view("a\0b", 3)); }),
              testing::HasSubstr("\"a\\x00b\""));
  EXPECT_THROW(SegmentName::checkBackplane(""), std::invalid_argument);
  EXPECT_NO_THROW(SegmentName::checkBackplane("A-z_09"));
}

TEST(SegmentName, RefusesAnInvalidServerNameAndNamesIt) {
  for (const std::string wrong : {"a\nb", "\x7f", "\t", "a\x01"}) {
    EXPECT_THAT(whatOf<std::invalid_argument>([&] { SegmentName::checkServer(wrong); }),
                testing::HasSubstr("\"" + printable(wrong) + "\""));
  }
  EXPECT_THROW(SegmentName::checkServer(""), std::invalid_argument);
  EXPECT_THROW(SegmentName::checkServer(std::string(layout::kNameChars, 'x')),
               std::invalid_argument);
  EXPECT_NO_THROW(SegmentName::checkServer(std::string(layout::kNameChars - 1, 'x')));
  EXPECT_NO_THROW(SegmentName::checkServer("AIM1/1 \xc3\xa9.[0]"));
}

class ForeignNames : public testing::TestWithParam<const char*> {};

TEST_P(ForeignNames, AreNotParsed) {
  EXPECT_FALSE(SegmentName::tryParse(GetParam())) << GetParam();
}
INSTANTIATE_TEST_SUITE_P(OfOtherPrograms, ForeignNames,
                         testing::Values("", ".", "mpf", "mpf.", "mpf.default", "mpf.default.c",
                                         "mpf.default.c.", "sem.mpf.default.c.1",
                                         "xmpf.default.c.1", "mpf.default.x.1", "mpf.default.cc.1",
                                         "mpf.default..1", "MPF.default.c.1"));
INSTANTIATE_TEST_SUITE_P(WithAWrongBackplane, ForeignNames,
                         testing::Values("mpf..c.1", "mpf.a b.c.1", "mpf.a/b.c.1",
                                         "mpf.012345678901234567890123456789012345678-.c.1"));
INSTANTIATE_TEST_SUITE_P(WithAWrongKey, ForeignNames,
                         testing::Values("mpf.default.c.g", "mpf.default.c.-1", "mpf.default.c.+1",
                                         "mpf.default.c.0x1", "mpf.default.c. 1",
                                         "mpf.default.c.1 ", "mpf.default.c.10000000000000000",
                                         "mpf.default.c.1.2", "mpf.default.h.", "mpf.default.f.1.2",
                                         "mpf.default.w.1."));
// Two names with the same numbers could not be told apart.
INSTANTIATE_TEST_SUITE_P(WithAnotherSpelling, ForeignNames,
                         testing::Values("mpf.default.c.01", "mpf.default.c.A", "mpf.default.h.00",
                                         "mpf.default.l.01.1", "mpf.default.l.1.aB",
                                         "mpf.default.b.1.00.0", "mpf.default.b.1.0.01",
                                         "mpf.default.p.1.01", "mpf.default.s.01.a",
                                         "mpf.default.s.-0.a"));
INSTANTIATE_TEST_SUITE_P(WithAWrongShape, ForeignNames,
                         testing::Values("mpf.default.l.1", "mpf.default.l.1.", "mpf.default.l..1",
                                         "mpf.default.l.1.2.3", "mpf.default.l.x.1",
                                         "mpf.default.b.1", "mpf.default.b.1.0",
                                         "mpf.default.b.1.0.0.0", "mpf.default.b.1.2.0",
                                         "mpf.default.b.1.0.x", "mpf.default.b.1.0.",
                                         "mpf.default.b.x.0.0"));
INSTANTIATE_TEST_SUITE_P(WithAWrongServer, ForeignNames,
                         testing::Values("mpf.default.s.0", "mpf.default.s.0.", "mpf.default.s..a",
                                         "mpf.default.s.x.a", "mpf.default.s.0.a.b",
                                         "mpf.default.s.2147483648.a", "mpf.default.s.0.a b",
                                         "mpf.default.s.0.%", "mpf.default.s.0.%2",
                                         "mpf.default.s.0.%2g", "mpf.default.s.0.%2f"));

}  // namespace
}  // namespace mpf::test

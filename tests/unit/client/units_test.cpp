// Texts that people type and read.
#include "client/cli/units.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <cstdlib>
#include <span>

#include "client/cli/table.h"
#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/base/text_width.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::cli {
namespace {

TEST(Units, TimesGrowIntoLargerUnits) {
  EXPECT_EQ(human_seconds(0), "0.0 s");
  EXPECT_EQ(human_seconds(0.02), "< 0.1 s");
  EXPECT_EQ(human_seconds(0.44), "0.4 s");
  EXPECT_EQ(human_seconds(12.3), "12 s");
  EXPECT_EQ(human_seconds(59.6), "1 min 00 s");
  EXPECT_EQ(human_seconds(185), "3 min 05 s");
  EXPECT_EQ(human_seconds(7380), "2 h 03 min");
  EXPECT_EQ(human_seconds(4 * 86400 + 3 * 3600), "4 d 03 h");
  EXPECT_EQ(human_seconds(-1), "?");
  EXPECT_EQ(human_seconds(std::nan("")), "?");
}

TEST(Units, RoughTimesHaveOneUnit) {
  EXPECT_EQ(rough_seconds(59.4), "59 s");
  EXPECT_EQ(rough_seconds(59.6), "1 min");
  EXPECT_EQ(rough_seconds(819), "14 min");
  EXPECT_EQ(rough_seconds(7380), "2.0 h");
  EXPECT_EQ(rough_seconds(86'300), "1.0 d");
  EXPECT_EQ(rough_seconds(86'400e3), "1000 d");
}

TEST(Units, OneIsSingular) {
  EXPECT_EQ(counted(0, "plane"), "0 planes");
  EXPECT_EQ(counted(1, "plane"), "1 plane");
  EXPECT_EQ(counted(2, "plane"), "2 planes");
}

TEST(Units, SignificantDigitsIncludeTrailingZeros) {
  EXPECT_EQ(significant(7, 2), "7.0");
  EXPECT_EQ(significant(9.96, 2), "10");
  EXPECT_EQ(significant(25, 2), "25");
  EXPECT_EQ(significant(0.0996, 2), "0.10");
  EXPECT_EQ(significant(0, 3), "0.00");
  EXPECT_EQ(significant(16, 4), "16.00");
  EXPECT_EQ(significant(12'345, 4), "1.234e+04");
  EXPECT_EQ(significant(0.0000123, 2), "1.2e-05");
}

TEST(Units, CountsKeepThreeDigits) {
  EXPECT_EQ(human_count(0), "0");
  EXPECT_EQ(human_count(950), "950");
  EXPECT_EQ(human_count(999.7), "1.00 k");
  EXPECT_EQ(human_count(1230), "1.23 k");
  EXPECT_EQ(human_count(45'600'000), "45.6 M");
  EXPECT_EQ(human_bytes(1023), "1023 B");
  EXPECT_EQ(human_bytes(1536), "1.50 KiB");
}

TEST(Units, SizesAreTwoNumbersWithinTheFilm) {
  EXPECT_EQ(*parse_size("640x480"), std::pair(640, 480));
  EXPECT_EQ(*parse_size("1X65536"), std::pair(1, 65536));
  for (const char* bad : {"", "640", "640x", "x480", "0x1", "1x65537", "-1x5", "64x64x64", "6 4x64", "64.5x64"}) {
    EXPECT_EQ(parse_size(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, CropsAreFourNumbers) {
  EXPECT_EQ(*parse_crop("0,10,64,32"), (PixelRect{0, 10, 64, 32}));
  for (const char* bad : {"", "1,2,3", "1,2,3,4,5", "0,0,0,1", "-1,0,1,1", "a,0,1,1", "0,0,1,", "0,0,1,1 "}) {
    EXPECT_EQ(parse_crop(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, SharesArePercentOrWords) {
  EXPECT_EQ(*parse_share("1%"), 0.01);
  EXPECT_EQ(*parse_share("0.5%"), 0.005);
  EXPECT_EQ(*parse_share("100%"), 1);
  EXPECT_EQ(*parse_share("all"), 1);
  EXPECT_EQ(*parse_share("none"), 0);
  for (const char* bad : {"", "%", "1", "0.01", "-1%", "101%", "nan%", "1 %", "ALL"}) {
    EXPECT_EQ(parse_share(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, TimesMayHaveAUnit) {
  EXPECT_EQ(*parse_seconds("90"), 90);
  EXPECT_EQ(*parse_seconds("1.5m"), 90);
  EXPECT_EQ(*parse_seconds("2h"), 7200);
  EXPECT_EQ(*parse_seconds("1d"), 86400);
  EXPECT_EQ(*parse_seconds("2w"), 1'209'600);
  for (const char* bad : {"", "s", "0", "-5", "nan", "inf", "5x", "5 s", "1e300", "1e9m"}) {
    EXPECT_EQ(parse_seconds(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Units, WholeNumbersAreWholeAndWithinTheirRange) {
  EXPECT_EQ(*parse_whole("18446744073709551615", std::uint64_t{0}, ~std::uint64_t{0}), ~std::uint64_t{0});
  EXPECT_EQ(*parse_whole("-7", std::int64_t{-9}, std::int64_t{9}), -7);
  for (const char* bad : {"", "-1", "1e3", "1.0", "0x10", " 1", "101", "18446744073709551616"}) {
    EXPECT_EQ(parse_whole(bad, std::uint64_t{0}, std::uint64_t{100}).status().code(), StatusCode::kInvalidArgument)
        << bad;
  }
  for (const char* bad : {"nan", "inf", "-65", "1e300", ""}) {
    EXPECT_EQ(parse_real(bad, -64, 64).status().code(), StatusCode::kInvalidArgument) << bad;
  }
}

TEST(Table, ShowsControlCharactersWithoutObeyingThem) {
  EXPECT_EQ(format_table({{"a\nb\x1b[31mred", "\xc2\x9b", "\xff", "\u202e", "é±…"}}, 0).front(),
            "a\\x0ab\\x1b[31mred  \\u009b  \\xff  \\u202e  é±…");
}

TEST(Text, IsCutBetweenCharacters) {
  EXPECT_EQ(cut_text("abc", 3), "abc");
  EXPECT_EQ(cut_text("abcd", 3), "abc…");
  EXPECT_EQ(cut_text("aéé", 4), "aé…") << "a byte of the second é is left out with it";
  EXPECT_EQ(cut_text("é", 1), "…");
}

/// A variable of this process, while the object exists.
class Variable {
 public:
  Variable(const char* name, const char* value)
      : name_(name), before_(std::getenv(name) == nullptr ? "" : std::getenv(name)) {
    ::setenv(name, value, 1);
  }
  ~Variable() { ::setenv(name_, before_.c_str(), 1); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* const name_;
  const std::string before_;
};

/// The time zone of this process, while the object exists.
class TimeZone {
 public:
  explicit TimeZone(const char* name) : before_(std::getenv("TZ") == nullptr ? "" : std::getenv("TZ")) { set(name); }
  ~TimeZone() { set(before_.c_str()); }
  TimeZone(const TimeZone&) = delete;
  TimeZone& operator=(const TimeZone&) = delete;

 private:
  static void set(const char* name) {
    ::setenv("TZ", name, 1);
    ::tzset();
  }
  const std::string before_;
};

TEST(Dates, AreLocalTimes) {
  constexpr std::int64_t kMoment = 951'782'400'999;  // 2000-02-29 00:00:00.999 UTC
  const TimeZone zone("XYZ-5:30");                   // POSIX: east of Greenwich is negative
  EXPECT_EQ(human_date(kMoment), "2000-02-29 05:30");
  EXPECT_EQ(human_moment(kMoment), "2000-02-29 05:30:00+0530");
  EXPECT_EQ(human_date(0), "-");
  EXPECT_EQ(human_day(0, 0), "-");
  EXPECT_EQ(human_day(kMoment, kMoment + 18 * 3'600'000), "05:30");
  EXPECT_EQ(human_day(kMoment, kMoment + 19 * 3'600'000), "2000-02-29") << "the next day has begun";
}

TEST(Names, AreUtf8OfBoundedLengthWithoutControlCharacters) {
  for (const std::string& good :
       {std::string(), std::string("Kühlturm 冷却塔"), std::string("می\u200cخواهم"), std::string(200, 'x')}) {
    EXPECT_TRUE(check_name("name", good).ok()) << good;
    EXPECT_EQ(as_name(good), good);
  }
  for (const std::string& bad :
       {std::string("a\nb"), std::string("a\0b", 3), std::string("\x7f"), std::string("\xc2\x85"),
        std::string("\xc0\xaf"), std::string("\xed\xa0\x80"), std::string("\xe2\x82"), std::string(201, 'x'),
        std::string("a\u200e"), std::string("\u200b"), std::string("\ufeff"), std::string("\u061c"),
        std::string("\U000e0041")}) {
    EXPECT_EQ(check_name("name", bad).code(), StatusCode::kInvalidArgument) << printable(bad);
    EXPECT_TRUE(check_name("name", as_name(bad)).ok()) << printable(bad);
  }
}

using Lines = std::vector<std::string>;

TEST(Table, PadsColumns) {
  EXPECT_EQ(format_table({{"A", "ERROR", "NAME"}, {"10", "±2%", "box"}}, 0),
            (Lines{"A   ERROR  NAME", "10  ±2%    box"}));
  EXPECT_EQ(format_table({{"A", "", "NAME"}, {"", "", "box"}}, 0), (Lines{"A    NAME", "     box"}));
}

TEST(Table, ColumnsThatDoNotFitStandBelowTheirRows) {
  const Rows rows{{"JOB", "NAME", "STATE", "OWNER", "SIZE"},
                  {"12", "cornell-bench-blocks", "running", "ada", "480x270"},
                  {"13", "box", "done", "", "-"}};
  EXPECT_EQ(format_table(rows, 40), (Lines{"JOB  NAME                  STATE", "12   cornell-bench-blocks  running",
                                           "    owner ada; size 480x270", "13   box                   done"}));
  EXPECT_EQ(format_table(rows, 20),
            (Lines{"JOB  NAME", "12   cornell…-blocks", "    name", "    cornell-bench-bl", "    ocks; state",
                   "    running; owner", "    ada; size", "    480x270", "13   box", "    state done"}));
}

TEST(Table, ALongNameIsShortenedInItsColumnAndWholeBelow) {
  const Rows workers{{"WORKER", "STATE", "HOST"},
                     {"render-node-1.studio.example", "working", "studio"},
                     {"render-node-2", "idle", "studio"}};
  EXPECT_EQ(format_table(workers, 45),
            (Lines{"WORKER                        STATE    HOST", "render-node-1.studio.example  working  studio",
                   "render-node-2                 idle     studio"}));
  EXPECT_EQ(format_table(workers, 40),
            (Lines{"WORKER                   STATE    HOST",  //
                   "render-node…dio.example  working  studio", "    worker render-node-1.studio.example",
                   "render-node-2            idle     studio"}));
}

TEST(Table, WrapsItsWidestColumn) {
  const Rows rows{{"METHOD", "WHY", "T"},
                  {"path", "the lamp's caustics are missing, as no camera path finds them", "2 s"}};
  EXPECT_EQ(format_table(rows, 40),
            (Lines{"METHOD  WHY                          T", "path    the lamp's caustics are      2 s",
                   "        missing, as no camera path", "        finds them"}));
}

TEST(Table, WrapsSeveralWideColumns) {
  const Rows rows{{"METHOD", "SHOWS", "PARAMETERS"},
                  {"vcm", "all light, by paths from both ends (vertex connection and merging)",
                   "photons=N, radius=C, no-absorption, brute-force"}};
  EXPECT_EQ(format_table(rows, 60),
            (Lines{"METHOD  SHOWS                      PARAMETERS",  //
                   "vcm     all light, by paths from   photons=N, radius=C,",
                   "        both ends (vertex          no-absorption,",  //
                   "        connection and merging)    brute-force"}));
}

TEST(Table, KeepsLongWordsWhole) {
  const std::string digest(30, 'd');
  EXPECT_EQ(format_table({{"NAME", "SIGNED BY", "DIGEST"}, {"ada", "the authority of the farm", digest}}, 42),
            (Lines{"NAME  SIGNED BY", "ada   the authority of the farm", "    digest " + digest}));
}

TEST(Table, RowsOfTwoCellsAreOnlyWrapped) {
  EXPECT_EQ(format_table({{"state", "waits for a worker"}, {"digest", std::string(20, 'd')}}, 18),
            (Lines{"state   waits for", "        a worker", "digest  dddddddddd", "        dddddddddd"}));
}

/// Like `lightmill jobs`: a name, and columns at the end that can be left out.
const Rows kJobs{
    {"JOB", "NAME", "STATE", "DONE", "SAMPLES", "METHOD", "OWNER", "SIZE"},
    {"12", "cornell-bench-small-lamp-with-a-glass-ball", "running", "12%", "8/64", "caustic", "ada", "1920x1080"},
    {"13", "box", "cancelled", "100%", "16384", "path or caustic", "bob", "96x80"}};
constexpr Squeeze kJobsGive{1, 6};

TEST(Table, ASqueezedRowTakesOneLine) {
  EXPECT_EQ(format_table(squeezed(kJobs, 140, kJobsGive), 140), format_table(kJobs, 0)) << "everything fits";
  EXPECT_EQ(
      format_table(squeezed(kJobs, 100, kJobsGive), 100),
      (Lines{"JOB  NAME                                STATE      DONE  SAMPLES  METHOD           OWNER  SIZE",
             "12   cornell-bench-sma…ith-a-glass-ball  running    12%   8/64     caustic          ada    1920x1080",
             "13   box                                 cancelled  100%  16384    path or caustic  bob    96x80"}));
  EXPECT_EQ(format_table(squeezed(kJobs, 80, kJobsGive), 80),
            (Lines{"JOB  NAME                       STATE      DONE  SAMPLES  METHOD           OWNER",
                   "12   cornell-benc…a-glass-ball  running    12%   8/64     caustic          ada",
                   "13   box                        cancelled  100%  16384    path or caustic  bob"}));
  for (int width = 64; width < 160; ++width) {
    const std::vector<std::string> lines = format_table(squeezed(kJobs, width, kJobsGive), width);
    EXPECT_EQ(lines.size(), kJobs.size()) << width;
    for (const std::string& line : lines) {
      EXPECT_LE(columns_of(line), width) << line;
    }
  }
}

TEST(Table, ASqueezedRowTakesTwoLinesWhereItsKeptColumnsDoNotFit) {
  EXPECT_EQ(
      format_table(squeezed(kJobs, 60, kJobsGive), 60),
      (Lines{"JOB  NAME                      STATE      DONE  SAMPLES",
             "12   cornell-benc…-glass-ball  running    12%   8/64", "    method caustic; owner ada; size 1920x1080",
             "13   box                       cancelled  100%  16384",
             "    method path or caustic; owner bob; size 96x80"}));
  for (int width = 43; width < 64; ++width) {
    EXPECT_EQ(format_table(squeezed(kJobs, width, kJobsGive), width).size(), 2 * kJobs.size() - 1) << width;
  }
}

TEST(Table, NarrowColumnsLeaveTheNameItsWidth) {
  const Rows rows{{"JOB", "NAME", "STATE", "OWNER"}, {"1", "box", "done", "ada"}};
  EXPECT_EQ(format_table(squeezed(rows, 17, {1, 3}), 17), (Lines{"JOB  NAME  STATE", "1    box   done"}));
}

TEST(Table, NamesThatWouldLookAlikeLoseWhatTheyHaveInCommon) {
  const Rows rows{{"JOB", "NAME", "STATE"},
                  {"1", "kitchen-in-the-morning-0017-with-all-the-lamps", "done"},
                  {"2", "garden", "done"},
                  {"3", "kitchen-in-the-morning-0018-with-all-the-lamps", "done"},
                  {"4", "kitchen-in-the-morning-0018-with-all-the-lamps", "done"},
                  {"5", "küche-für-alle-tage-im-jahr-ä-mit-allen-lampen", "done"},
                  {"6", "küche-für-alle-tage-im-jahr-ö-mit-allen-lampen", "done"}};
  EXPECT_EQ(format_table(squeezed(rows, 36, {1, 3}), 36),
            (Lines{"JOB  NAME                      STATE", "1    kitche…0017-wit…he-lamps  done",
                   "2    garden                    done", "3    kitche…0018-wit…he-lamps  done",
                   "4    kitche…0018-wit…he-lamps  done", "5    küche-…ä-mit-al…n-lampen  done",
                   "6    küche-…ö-mit-al…n-lampen  done"}));
}

TEST(Table, ColorsTakeNoColumns) {
  const Coloring red{1, [](std::string_view text) { return text == "failed" ? 31 : 0; }};
  EXPECT_EQ(format_table({{"JOB", "STATE", "NAME"}, {"1", "failed", "box"}, {"2", "done", "failed"}}, 0, red),
            (Lines{"JOB  STATE   NAME", "1    \x1b[31mfailed\x1b[0m  box", "2    done    failed"}));
}

TEST(Table, LosesNothingAtAnyWidth) {
  const Rows rows{
      {"JOB", "DIGEST", "NAME", "REASON"},
      {"7", std::string(64, 'd'), "冷却塔-with-a-long-name", "waits for a larger worker: for small: memory"},
      {"8", "", "b", "ok"}};
  for (int width = 4; width < 160; ++width) {
    std::string shown;
    for (const std::string& line : format_table(rows, width)) {
      EXPECT_LE(columns_of(line), width) << line;
      EXPECT_FALSE(line.ends_with(' ')) << line;
      shown += line;
    }
    for (const auto& row : std::span(rows).subspan(1)) {
      for (const std::string& cell : row) {
        for (const char c : cell) {
          EXPECT_GE(std::ranges::count(shown, c), std::ranges::count(cell, c)) << width << ": " << cell;
        }
      }
    }
  }
}

TEST(TextWidth, ColumnsSetsTheWidthOfAnyOutput) {
  const test::TemporaryFolder folder;
  const int file = ::open((folder.path() / "output").c_str(), O_CREAT | O_WRONLY, 0600);
  int terminal = -1, side = -1;
  const winsize size{24, 66, 0, 0};
  ASSERT_EQ(::openpty(&terminal, &side, nullptr, nullptr, &size), 0);
  const Variable unset("COLUMNS", "");
  EXPECT_EQ(output_columns(file), 0) << "no limit";
  EXPECT_EQ(output_columns(side), 66);
  for (const char* number : {"20", "120", "10000"}) {
    const Variable columns("COLUMNS", number);
    EXPECT_EQ(output_columns(file), std::atoi(number));
    EXPECT_EQ(output_columns(side), std::atoi(number));
  }
  for (const char* nonsense : {"0", "19", "10001", "-80", "80x24", " 80", "wide"}) {
    const Variable columns("COLUMNS", nonsense);
    EXPECT_EQ(output_columns(file), 0) << nonsense;
    EXPECT_EQ(output_columns(side), 66) << nonsense;
  }
  for (const int descriptor : {file, terminal, side}) {
    ::close(descriptor);
  }
}

TEST(TextWidth, WrapsBetweenWordsAndWithinLongOnes) {
  EXPECT_EQ(wrap_to_columns("", 5), (Lines{""}));
  EXPECT_EQ(wrap_to_columns("one two  three", 8), (Lines{"one two", "three"}));
  EXPECT_EQ(wrap_to_columns("a digest 0123456789", 8), (Lines{"a digest", "01234567", "89"}));
  EXPECT_EQ(wrap_to_columns("waits for 10 min.", 12), (Lines{"waits for", "10 min."}));
  EXPECT_EQ(wrap_to_columns("waits for 10 mines", 12), (Lines{"waits for 10", "mines"}));
  EXPECT_EQ(wrap_to_columns("1000 min", 4), (Lines{"1000", "min"})) << "too narrow for both";
  EXPECT_EQ(wrap_to_columns("冷却塔", 5), (Lines{"冷却", "塔"}));
}

TEST(Table, StaysAlignedBelowWideNames) {
  const std::vector<std::string> lines = format_table({{"NAME", "N"}, {"冷却塔", "1"}, {"e\u0301té", "2"}}, 0);
  EXPECT_EQ(lines, (std::vector<std::string>{"NAME    N", "冷却塔  1", "e\u0301té     2"}));
}

// Expected widths: Unicode's East_Asian_Width (W and F take two columns) and its combining marks (none).
TEST(TextWidth, CountsTerminalColumns) {
  for (const auto& [text, columns] : {std::pair{"", 0},
                                      {"plain", 5},
                                      {"±2% …", 5},
                                      {"Kühlturm", 8},
                                      {"冷却塔", 6},
                                      {"한글", 4},
                                      {"ＡＢ", 4},
                                      {"🚀x", 3},
                                      {"e\u0301", 1},
                                      {"a\u200bb", 2},
                                      {"\xff", 1},
                                      {"\xe2\x82", 1}}) {
    EXPECT_EQ(columns_of(text), columns) << text;
  }
}

TEST(TextWidth, CutsBetweenCharacters) {
  EXPECT_EQ(cut_to_columns("冷却塔", 6), "冷却塔");
  EXPECT_EQ(cut_to_columns("冷却塔", 5), "冷却");
  EXPECT_EQ(cut_to_columns("冷却塔", 1), "");
  EXPECT_EQ(cut_to_columns("e\u0301té", 1), "e\u0301") << "a combining mark stays with its character";
  EXPECT_EQ(cut_to_columns("👩\u200d💻", 3), "👩") << "without a joiner, which would join the next character";
  EXPECT_EQ(cut_to_columns("±2%", 2), "±2");
  EXPECT_EQ(cut_to_columns("text", 0), "");
}

}  // namespace
}  // namespace lightmill::cli

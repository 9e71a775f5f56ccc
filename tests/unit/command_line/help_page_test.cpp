// Help pages, and errors of unreadable command lines.
#include "common/command_line/help_page.h"

#include <gtest/gtest.h>

#include "common/base/suggestion.h"
#include "common/base/text_width.h"
#include "common/command_line/usage_errors.h"

namespace lightmill {
namespace {

struct Mill {
  CLI::App app{"Grinds.\n\n  mill grind wheat\n\nStops when nothing is left, or when somebody asks it to stop.",
               "mill"};
  std::string grain, size = "fine";
  int stones = 2;
  bool rye = false, oats = false, late = false;

  Mill() {
    CLI::App* grind = app.add_subcommand("grind", "Grind grain.")->group("Work");
    grind->add_option("GRAIN", grain, "what to grind")->required();
    grind->add_option("--size", size, "how large the pieces are that come out")
        ->type_name("SIZE")
        ->capture_default_str();
    grind->add_option("--stones", stones, "how many stones")->type_name("N")->envname("MILL_STONES")->group("Stones");
    CLI::App* grow = app.add_subcommand("grow", "Grow grain.")->group("Work");
    grow->add_flag("--rye", rye, "grow rye");
    grow->add_flag("--oats", oats, "grow oats")->excludes("--rye");
    grow->add_flag("--late", late, "sow late")->needs("--rye");
    app.add_subcommand("halt", "Stop the mill.")->group("Ends");
    app.require_subcommand(1);
  }
  CommandDoc grind() { return command_of(*app.get_subcommand("grind")); }
  std::string error_of(std::vector<std::string> words) {
    try {
      app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::ParseError& error) {
      return usage_error_text(app, error, words);
    }
    return "";
  }
};

TEST(HelpPage, ListsTheArgumentsOfACommand) {
  Mill mill;
  EXPECT_EQ(help_page(mill.grind(), 80), R"(Grind grain.

Usage: mill grind GRAIN [OPTIONS]

  GRAIN     what to grind

Options:
  -h,--help    Print this help message and exit
  --size SIZE  how large the pieces are that come out (default: fine)

Stones:
  --stones N  how many stones (default: $MILL_STONES)
)");
}

TEST(HelpPage, ListsCommandsByGroupAndKeepsExamples) {
  Mill mill;
  EXPECT_EQ(help_page(command_of(mill.app), 40), R"(Grinds.

  mill grind wheat

Stops when nothing is left, or when
somebody asks it to stop.

Usage: mill [OPTIONS] COMMAND

Work:
  grind     Grind grain.
  grow      Grow grain.

Ends:
  halt      Stop the mill.

Options:
  -h,--help  Print this help message and
             exit
)");
}

TEST(HelpPage, ALongExampleStaysACommandThatAShellReads) {
  const std::string text =
      "  mill grind wheat                fine flour\n"
      "  mill grind wheat rye --size fine --stones 3  flour for bread that is baked tomorrow\n";
  EXPECT_EQ(wrapped_text(text, 80), R"(  mill grind wheat
      fine flour
  mill grind wheat rye --size fine --stones 3
      flour for bread that is baked tomorrow
)");
  EXPECT_EQ(wrapped_text(text, 40), R"(  mill grind wheat
      fine flour
  mill grind wheat rye --size fine \
    --stones 3
      flour for bread that is baked
      tomorrow
)");
}

TEST(HelpPage, AllCommentsOfABlockMoveIfOneDoesNotFit) {
  EXPECT_EQ(wrapped_text("Examples:\n  mill grind wheat --size fine  flour for cakes\n  mill halt   stop\n", 40),
            R"(Examples:
  mill grind wheat --size fine
      flour for cakes
  mill halt
      stop
)");
}

TEST(HelpPage, CommentsBesideShortExamplesAreWrapped) {
  EXPECT_EQ(
      wrapped_text("Topics:\n\n  corn    sorts of corn\n  stones  which stones a mill needs, and for how long\n", 40),
      R"(Topics:

  corn      sorts of corn
  stones    which stones a mill needs,
            and for how long
)");
}

TEST(HelpPage, OptionsForAccessAreInOneLine) {
  Mill mill;
  for (const char* const option : {"--key", "--lock"}) {
    mill.app.add_option(option, mill.size, "a text that is not shown")->type_name("FILE")->group(kBriefAccess);
  }
  const std::string page = help_page(command_of(mill.app), 80);
  EXPECT_NE(page.find("\nAccess (`lightmill help access`):\n  --key FILE, --lock FILE\n"), std::string::npos) << page;
  EXPECT_EQ(page.find("a text that is not shown"), std::string::npos) << page;
}

TEST(HelpPage, LinesEndOutsideCommandsAndDefaults) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(wrap_sentences("the miller says `mill grind wheat`, and then", 30),
            (Lines{"the miller says", "`mill grind wheat`, and then"}));
  EXPECT_EQ(wrap_sentences("how many stones (default: 200 million) are", 28),
            (Lines{"how many stones", "(default: 200 million) are"}));
  EXPECT_EQ(wrap_sentences("how many stones (default: $MILL_STONES, else two)", 40),
            (Lines{"how many stones (default: $MILL_STONES,", "else two)"}));
  EXPECT_EQ(wrap_sentences("a `command that is longer than a line` is cut", 20),
            (Lines{"a `command that is", "longer than a line`", "is cut"}));
  EXPECT_EQ(wrap_sentences("one ` alone is no command", 12), (Lines{"one ` alone", "is no", "command"}));
}

TEST(HelpPage, AWordThatIsLongerThanALineStaysWhole) {
  EXPECT_EQ(wrap_lines("the token is\nlightmill-0123456789abcdef and two  words", 20),
            "the token is\nlightmill-0123456789abcdef\nand two  words");
  EXPECT_EQ(wrap_lines("the token is a word", 16), "the token is a word") << "too narrow to wrap";
}

TEST(HelpPage, AnExampleIsNotBrokenBetweenAnOptionAndItsValue) {
  EXPECT_EQ(wrapped_text("  mill grind wheat barley oats -o flour --fast --size fine", 40),
            R"(  mill grind wheat barley oats \
    -o flour --fast --size fine
)");
}

TEST(HelpPage, AVariableComesBeforeTheDefault) {
  Mill mill;
  mill.app.add_option("--stream", mill.size, "drives it")
      ->type_name("NAME")
      ->envname("MILL_STREAM")
      ->default_str("brook");
  const std::string page = help_page(command_of(mill.app), 80);
  EXPECT_NE(page.find("  --stream NAME  drives it (default: $MILL_STREAM, else brook)\n"), std::string::npos) << page;
}

TEST(HelpPage, ShowsSeveralValuesWithOneEllipsis) {
  Mill mill;
  std::vector<std::string> sorts, states;
  mill.app.add_option("--sort", sorts, "of grain")->type_name("SORT");
  mill.app.add_option("--state", states, "of grain")->type_name("STATE,...")->delimiter(',');
  const std::string page = help_page(command_of(mill.app), 80);
  EXPECT_NE(page.find("\n  --sort SORT...     of grain\n  --state STATE,...  of grain\n"), std::string::npos) << page;
}

TEST(HelpPage, FitsItsWidth) {
  Mill mill;
  mill.app.footer(
      "  mill grind the-wheat-of-last-year-and-of-this-year --size fine --stones 2 --sort red  with a comment");
  mill.app.add_option("--a-name-that-is-longer-than-the-column-of-names", mill.size, "is above its text")
      ->type_name("X");
  for (const int columns : {60, 80, 100}) {
    const std::string page = help_page(command_of(mill.app), columns);
    for (std::size_t at = 0; at < page.size();) {
      const std::string line = page.substr(at, page.find('\n', at) - at);
      EXPECT_LE(columns_of(line), columns) << line;
      at += line.size() + 1;
    }
  }
}

TEST(UsageErrors, NameTheNearestWord) {
  EXPECT_EQ(Mill().error_of({"girnd", "wheat"}), "unknown command 'girnd'. Did you mean 'grind'?");
  EXPECT_EQ(Mill().error_of({"dance"}), "unknown command 'dance'. Commands: grind, grow, halt");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--sise", "3"}),
            "`mill grind` has no option --sise. Did you mean '--size'?");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--sise=3"}),
            "`mill grind` has no option --sise. Did you mean '--size'?");
  EXPECT_EQ(Mill().error_of({"grind", "--sise", "3"}), "`mill grind` has no option --sise. Did you mean '--size'?");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--beautifully"}), "`mill grind` has no option --beautifully");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "rye"}), "unexpected argument 'rye'");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--size", "a", "--size", "b"}), "--size is given more than once");
  EXPECT_EQ(Mill().error_of({"grind"}), "GRAIN must be given");
  EXPECT_EQ(Mill().error_of({}), "a command is missing. Commands: grind, grow, halt");
  EXPECT_EQ(did_you_mean("abc", {"xyz", "abd", "abcd"}), ". Did you mean 'abd'?");
}

TEST(UsageErrors, ACommandBelowAnotherIsNamedWhole) {
  Mill mill;
  mill.app.get_subcommand("halt")->add_subcommand("gently", "Stop it slowly.");
  EXPECT_EQ(mill.error_of({"gently"}), "unknown command 'gently'. Did you mean `mill halt gently`?");
}

TEST(UsageErrors, OptionsBeforeTheirCommandAreMovedBehindIt) {
  EXPECT_EQ(Mill().error_of({"--size", "very fine", "grind", "wheat"}),
            "--size must follow its command: `mill grind wheat --size 'very fine'`");
  EXPECT_EQ(Mill().error_of({"--rye", "grow"}), "--rye must follow its command: `mill grow --rye`");
  EXPECT_EQ(Mill().error_of({"--size=3", "--stones", "2", "grind"}),
            "--size must follow its command: `mill grind --size=3 --stones 2`");
  EXPECT_EQ(Mill().error_of({"--sise", "3", "grind", "wheat"}),
            "`mill grind` has no option --sise. Did you mean '--size'?");
  EXPECT_EQ(Mill().error_of({"girnd", "grow"}), "unknown command 'girnd'. Did you mean 'grind'?");
}

TEST(UsageErrors, HaveNoWordsOfTheParser) {
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--size"}), "--size: a value is expected, got none");
  EXPECT_EQ(Mill().error_of({"grind", "wheat", "--stones", "few"}), "--stones: a number is expected, got 'few'");
  EXPECT_EQ(Mill().error_of({"grow", "--rye=much"}), "--rye takes no value, got 'much'");
  EXPECT_EQ(Mill().error_of({"grow", "--rye", "--oats"}), "--rye and --oats cannot be combined");
  EXPECT_EQ(Mill().error_of({"grow", "--late"}), "--late is given without --rye");
}

TEST(UsageErrors, NameTheKnownWords) {
  const std::vector<std::string> states{"queued", "running"};
  EXPECT_EQ(unknown_text("state", "runnin", states),
            "unknown state 'runnin'. Did you mean 'running'? Known states: queued, running");
  EXPECT_EQ(unknown_text("state", "o\x1b[m", states), "unknown state 'o\\x1b[m'. Known states: queued, running");
}

}  // namespace
}  // namespace lightmill

#include <gtest/gtest.h>

#include "common/command_line/descriptions.h"

namespace lightmill::test {
namespace {

/// A program with one of each kind of entry.
class CommandDocs : public testing::Test {
 protected:
  CommandDocs() {
    app_.footer("The end.");
    app_.add_option("--color", color_, "its colour")->type_name("red|dark-blue")->envname("MILL_COLOR");
    app_.add_option("--secret", secret_, "not told")->group("");
    CLI::App* grind = app_.add_subcommand("grind", "Make it fine.");
    grind->fallthrough();
    grind->add_option("GRAIN", grain_, "what's ground")->type_name("FILE")->required();
    grind->add_option("--mill", mill_, "where (without a value: here)")
        ->type_name("HOST:PORT")
        ->expected(0, 1)
        ->default_str("here");
    grind->add_option_group("limits")->add_option("-n,--times", times_, "how often: [1:9]");
    app_.add_subcommand("hidden", "")->group("");
  }

  CLI::App app_{"Grinds things. Finely.", "mill"};
  std::string color_, secret_, grain_, mill_;
  std::vector<int> times_;
};

TEST_F(CommandDocs, TreeHasTheEntriesOfHelpAndNoHiddenOnes) {
  const CommandDoc mill = command_tree(app_);
  ASSERT_EQ(mill.options.size(), 2u);  // and --help
  EXPECT_EQ(mill.options[1].names, std::vector<std::string>{"--color"});
  EXPECT_EQ(mill.options[1].variable, "MILL_COLOR");
  ASSERT_EQ(mill.commands.size(), 1u);
  EXPECT_EQ(mill.footer, "The end.");
  EXPECT_FALSE(mill.needs_command);
}

TEST_F(CommandDocs, CommandsHaveTheOptionsOfTheirGroupsAndParents) {
  const CommandDoc grind = command_tree(app_).commands.at(0);
  EXPECT_EQ(grind.words(), "mill grind");
  EXPECT_EQ(grind.footer, "") << "its parent's is not told twice";
  ASSERT_EQ(grind.positions.size(), 1u);
  EXPECT_TRUE(grind.positions[0].required);
  ASSERT_EQ(grind.options.size(), 4u);
  EXPECT_EQ(grind.options[2].names, (std::vector<std::string>{"-n", "--times"}));
  EXPECT_TRUE(grind.options[2].repeats);
  EXPECT_EQ(grind.options[3].names, std::vector<std::string>{"--color"});
}

TEST_F(CommandDocs, AnOptionalValueIsNotADefault) {
  const CommandDoc mill = command_tree(app_);
  const OptionDoc& option = mill.commands.at(0).options[1];
  EXPECT_TRUE(option.value_optional);
  EXPECT_EQ(option.shown_value(), "[HOST:PORT]");
  EXPECT_EQ(option.default_value, "") << "without the option nothing is used";
  EXPECT_FALSE(mill.options[1].value_optional);
  EXPECT_NE(man_page(mill, "1.0", "").find("\\fB\\-\\-mill\\fR \\fI[HOST:PORT]\\fR\nwhere (without a value: here)\n"),
            std::string::npos);
  EXPECT_NE(zsh_completion(mill).find("'(--mill)'--mill='[where (without a value\\: here)]::HOST\\:PORT: '"),
            std::string::npos);
}

TEST(ValueChoice, IsReadFromTheTypeName) {
  EXPECT_EQ(choice_of("FILE|NAME").kind, ValueChoice::Kind::file);
  EXPECT_EQ(choice_of("DIR").kind, ValueChoice::Kind::folder);
  EXPECT_EQ(choice_of("plain|filmic").words, (std::vector<std::string>{"plain", "filmic"}));
  for (const char* other : {"HOST:PORT", "N", "A|B", "word", ""}) {
    EXPECT_EQ(choice_of(other).kind, ValueChoice::Kind::anything) << other;
  }
}

TEST_F(CommandDocs, ManPageEscapesTroffSyntax) {
  app_.get_subcommand("grind")->description(".start\n\n  kept -as\n  lines\n\nafter \\ `it's`");
  const std::string page = man_page(command_tree(app_), "1.0", "2026-11-23");
  EXPECT_NE(page.find(".TH MILL 1 \"2026-11-23\" \"Lightmill 1.0\""), std::string::npos) << page;
  EXPECT_NE(page.find("\nmill \\- Grinds things\n"), std::string::npos);
  EXPECT_NE(page.find("\n.PP\n\\&.start\n.PP\n.nf\n  kept \\-as\n  lines\n.fi\n.PP\nafter \\e \\fBit\\(aqs\\fR\n"),
            std::string::npos)
      << page;
  EXPECT_NE(page.find(".SH ENVIRONMENT\n.TP\n\\fBMILL_COLOR\\fR\nas \\fB\\-\\-color\\fR\n"), std::string::npos);
  EXPECT_EQ(page.find("secret"), std::string::npos);
}

TEST_F(CommandDocs, MarkdownHasATableForEachGroup) {
  app_.footer("Two lines\nof text.\n\n  mill grind wheat\n");
  app_.get_option("--color")->description("its colour, such as <red> or *blue*")->required();
  const std::string page = markdown_page(command_tree(app_));
  EXPECT_NE(page.find("## mill\n\nGrinds things. Finely.\n\n```text\nUsage: mill --color red|dark-blue [OPTIONS] "
                      "[COMMAND]\n```\n"),
            std::string::npos)
      << page;
  EXPECT_NE(page.find("| `--color red\\|dark-blue` | its colour, such as \\<red> or \\*blue\\* (must be given); or "
                      "`$MILL_COLOR` |\n"),
            std::string::npos);
  EXPECT_NE(page.find("Two lines of text.\n\n```text\nmill grind wheat\n```\n"), std::string::npos);
  EXPECT_NE(page.find("### mill grind\n\nMake it fine.\n"), std::string::npos);
  EXPECT_NE(page.find("| Argument | |\n| --- | --- |\n| `GRAIN` | what's ground |\n"), std::string::npos);
  EXPECT_NE(page.find("| `-n, --times INT...` | how often: [1:9] |\n"), std::string::npos);
  EXPECT_EQ(page.find("secret"), std::string::npos);
}

TEST_F(CommandDocs, MarkdownDescribesSharedOptionsOnce) {
  for (const char* name : {"sow", "reap", "thresh"}) {
    app_.add_subcommand(name, "Work.")->add_option("--field", mill_, "the field")->type_name("N");
  }
  const std::string page = markdown_page(command_tree(app_));
  const std::string row = "| `--field N` | the field |\n";
  ASSERT_NE(page.find(row), std::string::npos) << page;
  EXPECT_GT(page.find(row), page.find("### Options of several commands\n"));
  EXPECT_EQ(page.find(row, page.find(row) + 1), std::string::npos);
  EXPECT_NE(page.find("### mill sow\n\nWork.\n\n```text\nUsage: mill sow [OPTIONS]\n```\n\n"
                      "[Also](#options-of-several-commands): `--help`, `--field`.\n"),
            std::string::npos)
      << page;
}

TEST_F(CommandDocs, ZshTextIsQuoted) {
  const std::string script = zsh_completion(command_tree(app_));
  EXPECT_NE(script.find("'*'{-n+,--times=}'[how often\\: \\[1\\:9\\]]:"), std::string::npos) << script;
  EXPECT_NE(script.find("':GRAIN:_files'"), std::string::npos);
  EXPECT_NE(script.find("'(--color)'--color='[its colour]:red|dark-blue:(red dark-blue)'"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test

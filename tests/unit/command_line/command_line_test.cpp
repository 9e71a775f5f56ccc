#include <gtest/gtest.h>

#include "common/command_line/command_tree.h"

namespace lightmill::test {
namespace {

/// A program with one of each kind of entry.
class CommandDocs : public testing::Test {
 protected:
  CommandDocs() {
    app_.footer("The end.");
    app_.add_option("--color", color_, "its colour")->type_name("red|dark-blue")->envname("MILL_COLOR");
    app_.add_option("--secret", secret_, "not shown")->group("");
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
  EXPECT_EQ(grind.footer, "") << "its parent's is not repeated";
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
}

}  // namespace
}  // namespace lightmill::test

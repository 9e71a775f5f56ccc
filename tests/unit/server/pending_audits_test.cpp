// Choice of results for audits, and conclusions from claims.
#include "server/domain/pending_audits.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

Claim claim(const std::string& machine, std::uint64_t hash) {
  return {{"worker on " + machine, machine}, {0, hash}};
}

/// A worker on this machine.
Renderer on(const std::string& machine, const std::string& fingerprint_class = "") {
  return {"", machine, fingerprint_class};
}

TEST(Judge, TwoMachinesThatAgreeDecide) {
  using enum Verdict::Kind;
  const auto kind = [](std::vector<Claim> claims) { return judge(claims).kind; };
  EXPECT_EQ(kind({}), open);
  EXPECT_EQ(kind({claim("a", 1)}), open);
  EXPECT_EQ(kind({claim("a", 1), claim("b", 2)}), open);
  EXPECT_EQ(kind({claim("a", 1), claim("b", 1)}), agreed);
  EXPECT_EQ(kind({claim("a", 1), claim("a", 1)}), open) << "one machine";
  EXPECT_EQ(kind({claim("", 1), claim("", 1)}), open) << "not known to be two";
  EXPECT_EQ(kind({claim("a", 1), claim("b", 2), claim("c", 3)}), program);
  EXPECT_EQ(kind({claim("a", 1), claim("a", 2), claim("b", 3)}), open) << "one machine that says two things is one";
  EXPECT_EQ(kind({claim("a", 1), claim("a", 2), claim("b", 3), claim("c", 3)}), agreed);
  EXPECT_EQ(kind({claim("a", 1), claim("a", 2), claim("b", 3), claim("c", 4)}), program);
  EXPECT_EQ(kind({Claim{{}, {0, 1}}, claim("b", 2), claim("c", 3)}), open)
      << "b may have rendered a part of the joined node";
  EXPECT_EQ(kind({Claim{{}, {0, 1}}, claim("b", 2), claim("c", 3), claim("d", 4)}), program);
  const Claim joined{{}, {0, 1}, {"a", "b"}};
  EXPECT_EQ(kind({joined, claim("a", 1)}), open) << "a confirms itself";
  EXPECT_EQ(kind({claim("b", 1), joined}), open);
  EXPECT_EQ(kind({joined, claim("c", 2), claim("a", 1)}), open);
  EXPECT_EQ(kind({joined, claim("c", 2), claim("a", 1), claim("b", 1)}), agreed) << "a and b say so by themselves";
  EXPECT_EQ(kind({joined, claim("c", 1)}), agreed);
  EXPECT_EQ(kind({Claim{{}, {0, 1}}, claim("c", 1)}), open) << "it may be c's own";
  const std::vector<Claim> first_is_wrong{claim("a", 1), claim("b", 2), claim("c", 2)};
  EXPECT_EQ(judge(first_is_wrong).kind, agreed);
  EXPECT_EQ(judge(first_is_wrong).hash, (Hash128{0, 2}));
}

TEST(AuditChoice, DependsOnTheSecretAndTheKeyAlone) {
  const Sha256 one = sha256("one"), two = sha256("two");
  int both = 0;
  for (std::uint32_t i = 0; i < 10'000; ++i) {
    const NodeKey key{JobId{1}, TileId{i % 7}, {0, i}};
    EXPECT_EQ(is_chosen(one, key, 0.1), is_chosen(one, key, 0.1));
    EXPECT_TRUE(is_chosen(one, key, 1));
    EXPECT_FALSE(is_chosen(one, key, 0));
    EXPECT_TRUE(!is_chosen(one, key, 0.1) || is_chosen(one, key, 0.2)) << "a larger share has the smaller one's";
    both += is_chosen(one, key, 0.1) && is_chosen(two, key, 0.1) ? 1 : 0;
  }
  // Independent: binomial(10000, 0.01), whose standard deviation is 9.95; 5 of them: false alarms in one of 10^6.
  EXPECT_NEAR(both, 100, 50);
}

/// The share of liars that are found within `results`, each wrong with probability `wrong`.
double found_within(const Sha256& secret, double share, double wrong, int results, int liars) {
  const Sha256 faults = sha256("faults");
  int found = 0;
  for (int liar = 0; liar < liars; ++liar) {
    for (int i = 0; i < results; ++i) {
      const NodeKey key{JobId{1 + static_cast<std::uint64_t>(liar)}, TileId{static_cast<std::uint32_t>(i)}, {3, 5}};
      // Faults are drawn independently of audits. A liar can do no better.
      if (is_chosen(secret, key, share) && is_chosen(faults, key, wrong)) {
        ++found;
        break;
      }
    }
  }
  return static_cast<double>(found) / liars;
}

TEST(AuditChoice, FindsLiarsAtTheStatedRate) {
  struct Case {
    double share, wrong;
    int results;
  };
  // The odds that docs/design/audits.md states.
  for (const auto& [share, wrong, results] :
       {Case{0.01, 1, 69}, Case{0.01, 1, 299}, Case{0.1, 1, 22}, Case{0.1, 0.01, 692}, Case{1, 0.01, 69}}) {
    constexpr int kLiars = 400;
    const double expected = 1 - std::pow(1 - share * wrong, results);
    const double deviation = std::sqrt(expected * (1 - expected) / kLiars);
    // Five standard deviations: a false alarm in one of 10^6.
    EXPECT_NEAR(found_within(sha256("farm"), share, wrong, results, kLiars), expected, 5 * deviation)
        << share << " " << wrong << " " << results;
  }
}

TEST(AuditChoice, FindsFewLargeResultsAsSurelyAsManySmallOnes) {
  constexpr int kLiars = 2000;
  constexpr double kShare = 0.01;
  for (const double wrong : {0.05, 0.5}) {  // of the job's pixel samples
    // Each of its parts is drawn with the share, in results of any size.
    const double expected = 1 - std::pow(1 - kShare, kPartsOfAJob * wrong);
    const double deviation = std::sqrt(expected * (1 - expected) / kLiars);
    for (const int parts : {1, 5, 50}) {  // of a result
      int found = 0;
      for (int liar = 0; liar < kLiars; ++liar) {
        bool drawn = false;
        for (int i = 0; i < static_cast<int>(kPartsOfAJob * wrong) / parts; ++i) {
          const NodeKey key{JobId{static_cast<std::uint64_t>(liar)}, TileId{static_cast<std::uint32_t>(i)}, {3, 5}};
          drawn = drawn || is_chosen(sha256(std::to_string(parts)), key, chance_of_audit(kShare, parts));
        }
        found += drawn ? 1 : 0;
      }
      EXPECT_NEAR(static_cast<double>(found) / kLiars, expected, 4 * deviation) << wrong << " in " << parts;
    }
  }
  EXPECT_EQ(chance_of_audit(1, 3), 1);
  EXPECT_EQ(chance_of_audit(0, 3), 0);
  EXPECT_NEAR(chance_of_audit(0.5, 2), 0.75, 1e-15);
}

TEST(PendingAudits, GoToOtherMachinesInUnitsOfOneRange) {
  PendingAudits all;
  for (std::uint32_t tile = 0; tile < 4; ++tile) {
    all.open({{2, 0}, TileId{tile}}, claim("a", tile));
  }
  all.open({{3, 1}, TileId{0}}, claim("a", 9));
  EXPECT_TRUE(all.next_for(on("a"), 8).empty());
  EXPECT_EQ(all.next_for(on("b"), 3).size(), 3u);
  const std::vector<PendingAudits::Key> next = all.next_for(on("b"), 8);
  ASSERT_EQ(next.size(), 4u);
  for (const PendingAudits::Key& place : next) {
    EXPECT_EQ(place.range, (SampleRange{2, 0}));
    all.lease(place, LeaseId{7});
  }
  EXPECT_EQ(all.out(), 4u);
  EXPECT_EQ(all.next_for(on("b"), 8), (std::vector<PendingAudits::Key>{{{3, 1}, TileId{0}}}));
  const std::string b = "b";
  all.release(next[0], LeaseId{8}, &b);
  EXPECT_EQ(all.out(), 4u) << "another lease";
  all.release(next[0], LeaseId{7}, nullptr);
  EXPECT_EQ(all.next_for(on("c"), 8), (std::vector<PendingAudits::Key>{next[0]}));
}

TEST(PendingAudits, OnlyMachinesWithoutAClaimTakeOverAnAudit) {
  PendingAudits all;
  const PendingAudits::Key place{{0, 0}, TileId{0}};
  all.open(place, claim("a", 1));
  all.lease(place, LeaseId{7});
  EXPECT_FALSE(all.take_over(place, LeaseId{7}, LeaseId{9}, on("a")));
  EXPECT_FALSE(all.take_over(place, LeaseId{8}, LeaseId{9}, on("c"))) << "another lease";
  EXPECT_EQ(all.find(place)->lease, LeaseId{7});
  EXPECT_TRUE(all.take_over(place, LeaseId{7}, LeaseId{9}, on("c")));
  EXPECT_EQ(all.out(), 1u);
  all.release(place, LeaseId{7}, nullptr);
  EXPECT_EQ(all.find(place)->lease, LeaseId{9}) << "the audit belongs to another lease now";
}

TEST(PendingAudits, ADisputeGoesToAThirdMachine) {
  PendingAudits all;
  const PendingAudits::Key place{{0, 0}, TileId{0}};
  all.open(place, claim("a", 1));
  EXPECT_EQ(all.claim(place, claim("b", 2)).kind, Verdict::Kind::open);
  EXPECT_TRUE(all.next_for(on("a"), 1).empty());
  EXPECT_TRUE(all.next_for(on("b"), 1).empty());
  EXPECT_EQ(all.next_for(on("c"), 1).size(), 1u);
  EXPECT_FALSE(all.possible_for(std::vector{on("a"), on("b")}));
  EXPECT_TRUE(all.possible_for(std::vector{on("a"), on("c")}));
  all.retract([](const Renderer& by) { return by.identity == "b"; });
  EXPECT_TRUE(all.disputed().empty());
  EXPECT_EQ(all.next_for(on("b"), 1).size(), 1u);
  EXPECT_EQ(all.claim(place, claim("c", 1)).kind, Verdict::Kind::agreed);
}

TEST(PendingAudits, AClassAuditsItsOwnResults) {
  PendingAudits all;
  const PendingAudits::Key of_x{{0, 0}, TileId{0}}, of_y{{0, 0}, TileId{1}};
  all.open(of_x, {{"w", "a", "x"}, {0, 1}});
  all.open(of_y, {{"v", "b", "y"}, {0, 2}});
  EXPECT_TRUE(all.next_for(on("a", "x"), 8).empty());
  EXPECT_EQ(all.next_for(on("b", "x"), 8), std::vector{of_x});
  EXPECT_EQ(all.next_for(on("a", "y"), 8), std::vector{of_y});
  EXPECT_TRUE(all.next_for(on("c", "z"), 8).empty());
  EXPECT_FALSE(all.possible_for(std::vector{on("a", "x"), on("b", "y"), on("c", "z")}));
  EXPECT_TRUE(all.possible_for(std::vector{on("c", "z"), on("c", "y")}));
  EXPECT_EQ(all.claim(of_x, {{"u", "c", "x"}, {0, 3}}).kind, Verdict::Kind::open);
  EXPECT_TRUE(all.next_for(on("d", "y"), 1) == std::vector{of_y}) << "another class does not decide this dispute";
  EXPECT_EQ(all.next_for(on("d", "x"), 1), std::vector{of_x});
  all.lease(of_y, LeaseId{7});
  EXPECT_FALSE(all.take_over(of_y, LeaseId{7}, LeaseId{9}, on("d", "x")));
  EXPECT_TRUE(all.take_over(of_y, LeaseId{7}, LeaseId{9}, on("d", "y")));
}

TEST(PendingAudits, AResultThatWasNotDrawnIsAuditedOnlyWhileDisputed) {
  PendingAudits all;
  const PendingAudits::Key place{{0, 0}, TileId{0}}, leased{{0, 0}, TileId{1}};
  for (const PendingAudits::Key& each : {place, leased}) {
    all.open(each, claim("a", 1), false);
    EXPECT_EQ(all.claim(each, claim("b", 2)).kind, Verdict::Kind::open);
  }
  all.lease(leased, LeaseId{3});
  all.retract([](const Renderer& by) { return by.identity == "b"; });
  EXPECT_EQ(all.find(place), nullptr);
  EXPECT_NE(all.find(leased), nullptr) << "a worker has its lease";
  all.release(leased, LeaseId{3}, nullptr);
  EXPECT_EQ(all.size(), 0u);
  EXPECT_FALSE(all.waiting());
}

TEST(PendingAudits, AnAuditThatOneIdentityLosesGoesToOthersUntilThreeLoseIt) {
  PendingAudits all;
  const PendingAudits::Key place{{0, 0}, TileId{0}};
  all.open(place, claim("a", 1));
  for (const std::string identity : {"b", "c", "d"}) {
    for (std::uint32_t i = 0; i < PendingAudits::kMaxLost; ++i) {
      ASSERT_EQ(all.next_for(on(identity), 1).size(), 1u) << identity << i;
      all.lease(place, LeaseId{i + 1});
      all.release(place, LeaseId{i + 1}, &identity);
    }
    EXPECT_TRUE(all.next_for(on(identity), 1).empty());
    EXPECT_FALSE(all.possible_for(std::vector{on("a"), on("b"), on(identity)}));
    EXPECT_EQ(all.possible_for(std::vector{on("e")}), identity != "d");
    EXPECT_EQ(all.lost(), 1u);
  }
  EXPECT_FALSE(all.waiting());
  EXPECT_EQ(all.size(), 1u);
  EXPECT_EQ(all.claim(place, claim("b", 1)).kind, Verdict::Kind::agreed) << "a late result counts";
  all.close(place);
  EXPECT_EQ(all.lost(), 0u);
}

TEST(PendingAudits, AnIdentityThatLosesADisputesAuditsGetsNoMore) {
  PendingAudits all;
  const PendingAudits::Key place{{0, 0}, TileId{0}};
  all.open(place, claim("a", 1));
  EXPECT_EQ(all.claim(place, claim("b", 2)).kind, Verdict::Kind::open);
  const std::string loser = "c";
  for (std::uint32_t i = 0; i < PendingAudits::kMaxLost; ++i) {
    all.lease(place, LeaseId{i + 1});
    all.release(place, LeaseId{i + 1}, &loser);
  }
  EXPECT_TRUE(all.next_for(on("c"), 1).empty());
  EXPECT_EQ(all.next_for(on("d"), 1).size(), 1u);
}

TEST(PendingAudits, AuditsWithinARangeAreClosed) {
  PendingAudits all;
  for (const SampleRange range : {SampleRange{0, 0}, SampleRange{0, 3}, SampleRange{1, 2}, SampleRange{2, 0}}) {
    all.open({range, TileId{0}}, claim("a", 1));
    all.open({range, TileId{1}}, claim("a", 1));
  }
  all.lease({{0, 3}, TileId{0}}, LeaseId{4});
  const auto closed = all.close_within(TileId{0}, {2, 0});
  ASSERT_EQ(closed.size(), 3u);
  EXPECT_EQ(closed[1].second, LeaseId{4});
  EXPECT_EQ(all.size(), 5u);
  EXPECT_EQ(all.out(), 0u);
}

}  // namespace
}  // namespace lightmill

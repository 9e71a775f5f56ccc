#include "tests/bench/swarm/swarm.h"

#include <absl/synchronization/mutex.h>

#include <cmath>
#include <condition_variable>
#include <functional>
#include <queue>

#include "common/base/check.h"
#include "common/base/clock.h"
#include "common/farm/job.h"
#include "common/film/tile_grid.h"
#include "worker/rpc/coordinator_link.h"
#include "worker/session/session.h"

namespace lightmill::bench {
namespace {

/// New connections per second. A cluster does not start all workers at once either.
constexpr double kConnectionsPerSecond = 1000;

/// Leases that a coordinator gives a worker. It gives up to kSmallUnitsFactor times more while the worker holds too few
/// tiles per thread.
constexpr std::size_t kLeasesPerWorker = 2, kSmallUnitsFactor = 8;

struct MadeNode {
  Node node;
  Hash128 hash;
};

/// Nodes, each created once for all workers that need its range and size. (All jobs have the same layers.)
class MadeNodes {
 public:
  std::shared_ptr<const MadeNode> get(const NodeLayout& layout, const SampleRange& range, std::size_t pixels) {
    if (made_.size() >= kMax) {
      made_.clear();
    }
    std::shared_ptr<const MadeNode>& made = made_[{range, pixels}];
    if (made == nullptr) {
      made = std::make_shared<const MadeNode>(make(layout, range, pixels));
    }
    return made;
  }

 private:
  static constexpr std::size_t kMax = 512;  ///< of 96 KiB; far more ranges than are in progress at once

  /// Whole numbers, whose sums do not depend on the order. Each sample is 2 in its half, and the first one is all in
  /// half A.
  static MadeNode make(const NodeLayout& layout, const SampleRange& range, std::size_t pixels) {
    const auto samples = static_cast<float>(range.count());
    MadeNode made{{range, std::vector<float>(layout.values(range) * pixels, samples), 0}, {}};
    if (range.count() == 1) {
      const std::size_t half = layout.summed * pixels;
      const bool odd = range.first() % 2 == 1;
      std::fill_n(made.node.values.begin(), half, odd ? 0.0f : 2.0f);
      std::fill_n(made.node.values.begin() + static_cast<std::ptrdiff_t>(half), half, odd ? 2.0f : 0.0f);
    }
    made.hash = hash_of(made.node);
    return made;
  }

  std::map<std::pair<SampleRange, std::size_t>, std::shared_ptr<const MadeNode>> made_;
};

}  // namespace

/// A thread's speed is between speed / sqrt(spread) and speed * sqrt(spread). The golden ratio spreads speeds evenly on
/// a logarithmic scale.
double speed_of(const SwarmOptions& options, std::uint32_t number) {
  const double place = std::fmod(0.5 + 0.618033988749895 * (options.first + number), 1.0);
  return options.threads * options.speed * std::pow(options.spread, place - 0.5);
}

double speed_of(const SwarmOptions& options) {
  double sum = 0;
  for (std::uint32_t number = 0; number < options.workers; ++number) {
    sum += speed_of(options, number);
  }
  return sum;
}

/// Queue from gRPC's threads to the swarm's thread.
struct Swarm::Inbox {
  using Event = std::function<void(Time now)>;

  void post(Event event) {
    const MutexLock lock(mutex);
    events.push_back(std::move(event));
    changed.notify_one();
  }
  /// Waits for events until `until`.
  std::vector<Event> take(Time until) {
    const MutexLock lock(mutex);
    while (events.empty()) {
      const Duration left = until - system_clock().now();
      if (left <= Duration::zero() ||
          changed.wait_until(mutex, std::chrono::steady_clock::now() + left) == std::cv_status::timeout) {
        break;
      }
    }
    return std::exchange(events, {});
  }

  Mutex mutex;
  CondVar changed;
  std::vector<Event> events LM_GUARDED_BY(mutex);
};

/// One worker. It lives on the swarm's thread, except for what its link posts.
class SwarmMember {
 public:
  SwarmMember(Swarm& swarm, MadeNodes& nodes, std::uint32_t number)
      : swarm_(swarm),
        nodes_(nodes),
        session_(config_of(swarm.options_, number)),
        seconds_per_pixel_sample_(swarm.options_.threads / speed_of(swarm.options_, number)),
        free_(swarm.options_.threads),
        link_({{swarm.options_.server}, {}}, handlers()) {}

  void start(Time now) { session_.start(now, actions_); }

  /// Does what is due and what the session asks for. Returns when it wants the next call.
  Time advance(Time now) {
    while (!rendering_.empty() && rendering_.begin()->first <= now) {
      const Rendering tile = std::move(rendering_.begin()->second);
      rendering_.erase(rendering_.begin());
      session_.tile_rendered({tile.ticket, tile.made->node, tile.made->hash, tile.seconds}, now, actions_);
    }
    if (const auto due = session_.next_deadline(); due && *due <= now) {
      session_.tick(now, actions_);
    }
    while (!actions_.empty()) {
      for (const SessionAction& action : std::exchange(actions_, {})) {
        std::visit([&](const auto& each) { perform(each, now); }, action);
      }
    }
    Time next = session_.next_deadline().value_or(Time::max());
    return rendering_.empty() ? next : std::min(next, rendering_.begin()->first);
  }

  Time next = Time::max();  ///< of its valid entry in the swarm's queue

 private:
  struct Rendering {
    std::uint64_t ticket = 0;
    std::shared_ptr<const MadeNode> made;
    double seconds = 0;
  };

  static SessionConfig config_of(const SwarmOptions& options, std::uint32_t number) {
    SessionConfig config;
    config.name = fmt::format("swarm-{}", options.first + number);
    config.host = config.machine = config.name;
    config.pid = 1;
    config.threads = options.threads;
    config.fingerprint_class = "swarm";
    config.renderer_version = kRendererVersion;
    return config;
  }

  LinkHandlers handlers() {
    LinkHandlers handlers;
    handlers.connected = [this](std::uint64_t stream, const std::string&) {
      post(stream, [this](Time now) {
        session_.connected(now, actions_);
        const MutexLock lock(swarm_.mutex_);
        ++swarm_.counts_.connected;
        connected_ = true;
      });
    };
    handlers.message = [this](std::uint64_t stream, CoordinatorMessage message) {
      const Time arrived = system_clock().now();
      post(stream, [this, arrived, message = std::move(message)](Time now) {
        note(message, arrived);
        session_.message(message, now, actions_);
      });
    };
    handlers.disconnected = [this](std::uint64_t stream, const std::string&, const Status&) {
      post(stream, [this](Time now) {
        if (std::exchange(connected_, false)) {
          const MutexLock lock(swarm_.mutex_);
          --swarm_.counts_.connected;
          ++swarm_.counts_.disconnects;
        }
        short_since_.reset();
        session_.disconnected(now, actions_);
      });
    };
    return handlers;
  }
  void post(std::uint64_t stream, std::function<void(Time)> event);

  /// Whether the coordinator owes the worker a lease, once it has received everything that was sent.
  bool may_have_more() const {
    std::size_t tiles = 0;
    for (const auto& [lease, left] : left_) {
      tiles += left;
    }
    return left_.size() < kLeasesPerWorker ||
           (left_.size() < kLeasesPerWorker * kSmallUnitsFactor && tiles < kLeasesPerWorker * swarm_.options_.threads);
  }

  void note(const CoordinatorMessage& message, Time arrived) {
    const MutexLock lock(swarm_.mutex_);
    if (const auto* const grant = std::get_if<LeaseGrant>(&message)) {
      ++swarm_.counts_.leases;
      left_[grant->lease] = grant->unit.tiles.size();
      // A lease from before `since` had already arrived, but was not read yet. It does not count.
      if (const auto since = std::exchange(short_since_, std::nullopt); since && *since < arrived) {
        swarm_.latencies_.lease.push_back(to_seconds(arrived - *since));
      }
    } else if (const auto* const ack = std::get_if<ResultAck>(&message)) {
      for (const NodeKey& key : ack->keys) {
        if (const auto sent = sent_.find(key); sent != sent_.end()) {
          ++swarm_.counts_.acknowledged;
          swarm_.latencies_.commit.push_back(to_seconds(arrived - sent->second));
          sent_.erase(sent);
        }
      }
    } else if (const auto* const cancel = std::get_if<LeaseCancel>(&message)) {
      for (const LeaseId lease : cancel->leases) {
        left_.erase(lease);
      }
      short_since_.reset();
    }
  }

  void perform(const OpenStream&, Time) { stream_ = link_.open(); }
  void perform(const CloseStream&, Time) { link_.close(); }
  void perform(const SendMessage& send, Time) {
    if (const auto* const result = std::get_if<WorkerResult>(send.message.get())) {
      const Time now = system_clock().now();
      sent_.try_emplace(result->key, now);
      if (const auto lease = left_.find(result->lease); lease != left_.end()) {
        if (--lease->second == 0) {
          left_.erase(lease);
        }
        if (!short_since_ && may_have_more()) {
          short_since_ = now;
        }
      }
      const MutexLock lock(swarm_.mutex_);
      ++swarm_.counts_.results;
      swarm_.counts_.result_bytes += result->node.values.size() * sizeof(float);
    }
    link_.send(send.message);
  }
  void perform(const PrepareJob& prepare, Time now) { session_.job_ready(prepare.description->job, now, actions_); }
  void perform(const RenderTile& tile, Time now) {
    const RenderSettings& settings = tile.description->settings;
    const auto pixels = static_cast<std::size_t>(TileGrid(settings.crop).tile_rect(tile.key.tile).pixel_count());
    const double seconds =
        static_cast<double>(pixels) * static_cast<double>(tile.key.range.count()) * seconds_per_pixel_sample_;
    Time& thread = *std::ranges::min_element(free_);
    thread = std::max(thread, now) + from_seconds(seconds);
    rendering_.emplace(
        thread, Rendering{tile.ticket, nodes_.get(NodeLayout(settings.layers), tile.key.range, pixels), seconds});
    const MutexLock lock(swarm_.mutex_);
    swarm_.counts_.busy_seconds += seconds;
  }
  void perform(const Exit& exit, Time) {
    LM_CHECK(!exit.failed, "the coordinator ended the session of a worker of the swarm: {}", exit.reason);
  }
  template <class Other>
  void perform(const Other&, Time) {}

  Swarm& swarm_;
  MadeNodes& nodes_;
  Session session_;
  SessionActions actions_;
  const double seconds_per_pixel_sample_;
  std::vector<Time> free_;                    ///< by thread: when its current work ends
  std::multimap<Time, Rendering> rendering_;  ///< by end time
  std::map<LeaseId, std::size_t> left_;       ///< tiles without a sent result
  std::optional<Time> short_since_;           ///< when a result was sent after which the coordinator owes a lease
  std::map<NodeKey, Time> sent_;
  std::uint64_t stream_ = 0;
  bool connected_ = false;
  CoordinatorLink link_;  ///< last, because it calls back
};

namespace {

/// Members by the time of their next call.
class Agenda {
 public:
  void put(SwarmMember& member, Time time) {
    if (time < member.next) {
      member.next = time;
      queue_.emplace(time, &member);
    }
  }
  /// A member whose time has come, or null.
  SwarmMember* take(Time now) {
    while (!queue_.empty() && queue_.top().first <= now) {
      const auto [time, member] = queue_.top();
      queue_.pop();
      if (member->next == time) {
        member->next = Time::max();
        return member;
      }
    }
    return nullptr;
  }
  Time next() const { return queue_.empty() ? Time::max() : queue_.top().first; }

 private:
  using Entry = std::pair<Time, SwarmMember*>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

}  // namespace

void SwarmMember::post(std::uint64_t stream, std::function<void(Time)> event) {
  swarm_.inbox_->post([this, stream, event = std::move(event)](Time now) {
    if (stream == stream_) {
      event(now);
    }
    swarm_.touched_.push_back(this);
  });
}

Swarm::Swarm(SwarmOptions options)
    : options_(std::move(options)),
      inbox_(std::make_unique<Inbox>()),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Swarm::~Swarm() = default;

void Swarm::run(const std::stop_token& stop) {
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);  // like the coordinator
  MadeNodes nodes;
  std::vector<std::unique_ptr<SwarmMember>> members;
  Agenda agenda;
  const Clock& clock = system_clock();
  const Time begun = clock.now();
  while (!stop.stop_requested()) {
    Time now = clock.now();
    const auto due = std::min<double>(options_.workers, to_seconds(now - begun) * kConnectionsPerSecond + 1);
    while (members.size() < static_cast<std::size_t>(due)) {
      members.push_back(std::make_unique<SwarmMember>(*this, nodes, static_cast<std::uint32_t>(members.size())));
      members.back()->start(now);
      agenda.put(*members.back(), now);
    }
    const Duration timeout =
        members.size() < options_.workers ? std::chrono::milliseconds(1) : std::chrono::milliseconds(100);
    for (const Inbox::Event& event : inbox_->take(std::min(agenda.next(), now + timeout))) {
      event(clock.now());
    }
    now = clock.now();
    for (SwarmMember* const member : std::exchange(touched_, {})) {
      agenda.put(*member, now);
    }
    while (SwarmMember* const member = agenda.take(now)) {
      agenda.put(*member, member->advance(now));
    }
  }
}

SwarmCounts Swarm::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

SwarmLatencies Swarm::take_latencies() {
  const MutexLock lock(mutex_);
  return std::exchange(latencies_, {});
}

}  // namespace lightmill::bench

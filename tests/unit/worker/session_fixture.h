// Fixture of a worker's session: a clock, and the actions that it asks for.
#pragma once

#include <gtest/gtest.h>

#include "worker/session/session.h"

namespace lightmill {

class SessionTest : public testing::Test {
 protected:
  SessionTest() { restart({}); }
  void restart(SessionConfig config) {
    config.name = "w";
    config.threads = 2;
    config.fingerprint_class = "class-a";
    config.renderer_version = kRendererVersion;
    session = std::make_unique<Session>(config);
  }

  static JobDescription description(std::uint64_t job = 1, const char* digest = "digest") {
    return {JobId{job}, sha256(digest), {}};
  }
  static LeaseGrant grant(std::uint64_t lease, std::uint32_t tiles, std::uint64_t job = 1, SampleRange range = {0, 0}) {
    LeaseGrant grant{LeaseId{lease}, {JobId{job}, range, {}}};
    for (std::uint32_t i = 0; i < tiles; ++i) {
      grant.unit.tiles.push_back(TileId{i});
    }
    return grant;
  }
  void say(CoordinatorMessage message) { session->message(message, now, actions); }
  void connect() {
    session->start(now, actions);
    come_back();
  }
  void come_back(Hash128 farm = {1, 1}) {
    session->connected(now, actions);
    say(Welcome{1, std::chrono::seconds(2), std::chrono::seconds(10), farm});
  }
  /// Connects, with a job ready and one lease.
  void begin(std::uint32_t tiles) {
    connect();
    say(description());
    session->job_ready(JobId{1}, now, actions);
    say(grant(1, tiles));
  }
  void pass(Duration time) {
    now += time;
    session->tick(now, actions);
  }
  void rendered(const RenderTile& tile, double seconds = 0.01) {
    Node node{tile.key.range, std::vector<float>(24, 1.0f), 0};
    const Hash128 hash = hash_of(node);
    session->tile_rendered({tile.ticket, std::move(node), hash, seconds}, now, actions);
  }
  /// All actions of one kind since the last `actions.clear()`.
  template <class T>
  std::vector<T> asked() const {
    std::vector<T> found;
    for (const SessionAction& action : actions) {
      if (const auto* each = std::get_if<T>(&action)) {
        found.push_back(*each);
      }
    }
    return found;
  }
  template <class T>
  std::vector<T> said() const {
    std::vector<T> found;
    for (const SendMessage& send : asked<SendMessage>()) {
      if (const auto* each = std::get_if<T>(send.message.get())) {
        found.push_back(*each);
      }
    }
    return found;
  }
  static ResultAck ack(const WorkerResult& result) { return {{result.key}}; }

  Time now{std::chrono::seconds(50)};
  std::unique_ptr<Session> session;
  SessionActions actions;
};

}  // namespace lightmill

// What `vcm` holds of a pass and of a batch, and how it finds it.
#include <gtest/gtest.h>

#include "common/methods/path/path_method.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

TEST(Vcm, ConnectionsTracedInPiecesAreTheSameBits) {
  const auto scene = test::TestScene(LIGHTMILL_SOURCE_DIR "/scenes/cornell-bench-balls.json").resized(64, 64);
  const MethodSettings settings{"vcm:photons=1000", 42, 0,
                                *film_layers(std::vector<std::string>{"direct", "indirect"})};
  const auto values = [&](std::uint32_t connections_at_once) {
    const auto method = make_vcm_method(scene.compiled(), settings, *parse_method(settings.name), connections_at_once);
    return method->render({0, 0, 64, 64}, {1, 0}, *method->make_workspace()).values;
  };
  const std::vector<float> whole = values(1u << 20);
  for (const std::uint32_t piece : {1u, 13u, 64u, 4096u, path::kConnectionsAtOnce}) {
    EXPECT_EQ(values(piece), whole) << piece << " at once";
  }
}

}  // namespace
}  // namespace lightmill

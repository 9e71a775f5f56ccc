// Renders a reference for the z-tests with the reference tracer: make_reference SCENE SAMPLES OUT
#include <cstdio>
#include <cstdlib>

#include "tests/support/block_means.h"
#include "tests/support/reference_tracer.h"

int main(int argc, char** argv) {
  using namespace lightmill;
  using namespace lightmill::test;
  if (argc != 4) {
    std::fprintf(stderr, "usage: make_reference SCENE SAMPLES OUT\n");
    return 2;
  }
  constexpr int kSeeds = 16;
  const int samples = std::atoi(argv[2]);
  const TestScene scene = TestScene(argv[1]).resized(kTestFilm, kTestFilm);
  const ReferenceTracer tracer(scene.scene(), scene.assets());
  std::vector<std::vector<double>> images;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const auto image = tracer.render({0, 0, kTestFilm, kTestFilm}, samples / kSeeds, 1000 + seed);
    images.emplace_back(image.begin(), image.end());
    std::fprintf(stderr, "%d of %d\n", seed + 1, kSeeds);
  }
  write_block_means(
      argv[3],
      fmt::format("reference tracer, {} samples per pixel, {}x{} film, blocks of {}x{}: mean and standard error",
                  samples, kTestFilm, kTestFilm, kBlock, kBlock),
      block_means(images));
}

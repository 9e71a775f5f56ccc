#include "worker/render/scene_cache.h"

namespace lightmill {

std::shared_ptr<const CompiledScene> SceneCache::find(const Sha256& key) {
  for (auto at = entries_.begin(); at != entries_.end(); ++at) {
    if (at->key == key) {
      entries_.splice(entries_.begin(), entries_, at);
      return at->scene;
    }
  }
  return nullptr;
}

void SceneCache::clear() {
  entries_.clear();
  bytes_ = 0;
}

void SceneCache::insert(const Sha256& key, std::shared_ptr<const CompiledScene> scene) {
  bytes_ += scene->bytes();
  entries_.push_front({key, std::move(scene)});
  while (entries_.size() > 1 && (entries_.size() > limits_.scenes || bytes_ > limits_.bytes)) {
    bytes_ -= entries_.back().scene->bytes();
    entries_.pop_back();
  }
}

}  // namespace lightmill

#include "common/wire/film_assembly.h"

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/film/film_hash.h"
#include "common/image/cryptomatte.h"
#include "common/scene/camera_matrices.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill {
namespace {

static_assert(kFirstSamples <= kMaxCryptomatteSamples);
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 30;

std::string capture_date(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm parts{};
  localtime_r(&seconds, &parts);
  return fmt::format("{:04}:{:02}:{:02} {:02}:{:02}:{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday,
                     parts.tm_hour, parts.tm_min, parts.tm_sec);
}

ImageWindow to_window(const v1::PixelRect& rect) {
  return {rect.x(), rect.y(), rect.width(), rect.height()};
}

bool lies_within(const ImageWindow& inner, const ImageWindow& outer) {
  return inner.width > 0 && inner.height > 0 && inner.x >= outer.x && inner.y >= outer.y &&
         std::int64_t{inner.x} + inner.width <= std::int64_t{outer.x} + outer.width &&
         std::int64_t{inner.y} + inner.height <= std::int64_t{outer.y} + outer.height;
}

Receipt receipt_of(const v1::FilmHeader& header, std::int64_t now_unix_ms) {
  const v1::Job& job = header.job();
  const v1::RenderSettings& settings = header.settings();
  Receipt receipt;
  receipt.render_digest =
      job.render_digest().empty() ? "" : digest_from_bytes(job.render_digest()).value_or(Sha256{}).hex();
  receipt.scene_digest = sha256(settings.scene()).hex();
  for (const std::string& asset : settings.assets()) {
    receipt.asset_digests.push_back(digest_from_bytes(asset).value_or(Sha256{}).hex());
  }
  receipt.renderer_version = settings.renderer_version();
  receipt.fingerprint_class = job.fingerprint_class();
  receipt.method = settings.method();
  const v1::MethodNotes& notes = job.method_notes();
  receipt.method_reasons.assign(notes.reasons().begin(), notes.reasons().end());
  receipt.notices.assign(notes.notices().begin(), notes.notices().end());
  receipt.max_bounces = settings.max_bounces();
  receipt.seed = settings.seed();
  receipt.job = job.id();
  receipt.name = job.name();
  receipt.owner = job.owner();
  receipt.host = job.host();
  if (job.has_error()) {
    receipt.rel_mse = job.error().rel_mse();
    receipt.rel_mse_half_width = job.error().half_width();
  }
  receipt.ended = job.state() == v1::JOB_STATE_DONE ? job.reason() : "";
  receipt.seconds = job.active_seconds();
  receipt.worker_seconds = job.worker_seconds();
  const std::int64_t when = job.finished_unix_ms() != 0 ? job.finished_unix_ms() : now_unix_ms;
  receipt.capture_date = capture_date(when);
  return receipt;
}

/// The names of the objects and materials, for the id layer.
PictureIds ids_in(const Scene& scene) {
  std::vector<std::string> objects, materials;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    objects.push_back(object.name.empty() ? fmt::format("objects[{}]", i) : object.name);
    materials.push_back(scene.materials[object.material].name);
  }
  return {std::move(objects), std::move(materials)};
}

/// Adds the scene's camera as OpenEXR's standard attributes.
Status add_camera_attributes(const std::string& packed_scene, FilmPicture& picture) {
  v1::Scene scene;
  const Result<Camera> camera = scene.ParseFromString(packed_scene)
                                    ? from_wire(scene.camera())
                                    : Result<Camera>(data_loss("the farm sent a scene that is damaged"));
  LM_RETURN_IF_ERROR(camera.status());
  const CameraMatrices matrices = camera_matrices(*camera, picture.display.width, picture.display.height);
  picture.attributes["worldToCamera"] = matrices.world_to_camera;
  picture.attributes["worldToNDC"] = matrices.world_to_ndc;
  return ok_status();
}

}  // namespace

Hash128 film_hash_of(const FilmPicture& picture) {
  std::vector<std::uint32_t> counts(picture.pixels());
  std::ranges::transform(picture.samples_a, picture.samples_b, counts.begin(), std::plus<>());
  std::vector<Hash128> meters;
  for (const std::string& hash : picture.receipt.meter_hashes) {
    meters.push_back(Hash128::from_hex(hash).value_or(Hash128{}));
  }
  FilmPlanesView planes{picture.half_a, picture.half_b, counts, {}, meters};
  for (const PictureLayer& layer : picture.layers) {
    planes.layers.emplace_back(layer.values);
  }
  return film_hash(planes);
}

Result<FilmAssembly> FilmAssembly::begin(const v1::FilmHeader& header, std::int64_t now_unix_ms) {
  const ImageWindow frame{0, 0, header.settings().width(), header.settings().height()};
  const ImageWindow crop = to_window(header.settings().crop());
  if (!lies_within(crop, frame) || crop.pixel_count() > kMaxPixels) {
    return data_loss("the farm sent a film of {}x{} pixels with crop {},{},{},{}", frame.width, frame.height, crop.x,
                     crop.y, crop.width, crop.height);
  }
  const Result<RenderSettings> settings = from_wire(header.settings());
  const Status status = settings.ok() ? check_layers(settings->layers) : settings.status();
  if (!status.ok()) {
    return data_loss("the farm sent a film whose settings are damaged: {}", message_of(status));
  }
  FilmAssembly assembly({header.job(), FilmPicture(frame, crop), {}}, NodeLayout(settings->layers));
  FilmPicture& picture = assembly.film_.picture;
  picture.receipt = receipt_of(header, now_unix_ms);
  LM_RETURN_IF_ERROR(add_camera_attributes(*settings->scene, picture));
  for (const LayerSpec& layer : std::span(settings->layers).subspan(1)) {
    picture.layers.push_back(make_picture_layer(layer.name, picture.pixels()));
  }
  if (assembly.layout_.first_samples > 0 || settings->meters > 0) {
    LM_ASSIGN_OR_RETURN(const Scene scene, unpack_scene(*settings->scene));
    assembly.ids_ = ids_in(scene);
    for (const Meter& meter :
         std::span(scene.meters).first(std::min<std::size_t>(settings->meters, scene.meters.size()))) {
      assembly.film_.meters.push_back({meter, {}});
    }
  }
  picture.receipt.meter_hashes.resize(assembly.film_.meters.size());
  return assembly;
}

Status FilmAssembly::add_meter(std::uint32_t meter, const v1::FilmTile& tile, std::span<const float> sums) {
  if (meter >= film_.meters.size() || sums.size() != layout_.summed_values() * kTileSize * kTileSize ||
      tile.samples_a() > tile.samples()) {
    return data_loss("the farm sent {} sums of meter {} of {}", sums.size(), meter, film_.meters.size());
  }
  NamedReading& reading = film_.meters[meter];
  reading.reading = read_meter(reading.meter, sums, layout_.summed, tile.samples());
  film_.picture.receipt.meter_hashes[meter] =
      meter_hash(sums, tile.samples_a(), tile.samples() - tile.samples_a()).hex();
  return ok_status();
}

Status FilmAssembly::add(const v1::FilmTile& tile) {
  least_ = std::min(least_, tile.samples());
  most_ = std::max(most_, tile.samples());
  FilmPicture& picture = film_.picture;
  const ImageWindow rect = to_window(tile.rect());
  LM_ASSIGN_OR_RETURN(const std::vector<float> sums, floats_from_bytes(tile.sums()));
  if (const PixelRect place{rect.x, rect.y, rect.width, rect.height}; is_meter_rect(place)) {
    return add_meter(meter_of(place), tile, sums);
  }
  LM_ASSIGN_OR_RETURN(const std::vector<float> first, floats_from_bytes(tile.first()));
  if (!lies_within(rect, picture.data) ||
      sums.size() != layout_.summed_values() * static_cast<std::size_t>(rect.pixel_count())) {
    return data_loss("the farm sent a tile at {},{} of {}x{} pixels with {} sums, outside the film", rect.x, rect.y,
                     rect.width, rect.height, sums.size());
  }
  if (tile.samples_a() > tile.samples()) {
    return data_loss("the farm sent a tile with {} of {} samples in half A", tile.samples_a(), tile.samples());
  }
  place_sums(picture, rect, tile.samples_a(), tile.samples() - tile.samples_a(), sums);
  if (tile.first_samples() > kFirstSamples ||
      !place_first_samples(picture.layers, picture.data, rect, tile.first_samples(), first, ids_)) {
    return data_loss("the farm sent a tile with {} values of {} samples for its layers", first.size(),
                     tile.first_samples());
  }
  return ok_status();
}

Result<AssembledFilm> FilmAssembly::finish() {
  FilmPicture& picture = film_.picture;
  if (least_ > most_) {
    return data_loss("the farm sent no film for job {}", film_.job.id());
  }
  picture.receipt.min_samples = least_;
  picture.receipt.max_samples = most_;
  picture.receipt.film_hash = film_hash_of(picture).hex();
  if (!film_.meters.empty()) {
    picture.attributes["lightmill.meters"] = to_json(film_.meters).dump();
  }
  if (layout_.first_samples > 0) {
    add_id_attributes(picture.attributes, ids_);
  }
  return std::move(film_);
}

nlohmann::json to_json(const std::vector<NamedReading>& readings) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [meter, reading] : readings) {
    const auto number = [known = reading.samples > 0](double value) {
      return known ? nlohmann::json(value) : nlohmann::json(nullptr);
    };
    list.push_back({{"name", meter.name},
                    {"quantity", quantity_of(meter)},
                    {"value", number(reading.value)},
                    {"half_width", number(reading.half_width)},
                    {"unit", radiometric_unit(meter)},
                    {"photometric", number(reading.photometric)},
                    {"photometric_half_width", number(reading.photometric_width)},
                    {"photometric_unit", photometric_unit(meter)},
                    {"rgb", {number(reading.rgb.x), number(reading.rgb.y), number(reading.rgb.z)}},
                    {"samples", reading.samples}});
  }
  return list;
}

}  // namespace lightmill

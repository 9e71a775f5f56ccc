#include "client/cli/film_fetch.h"

#include <unistd.h>

#include <ctime>
#include <nlohmann/json.hpp>
#include <set>

#include "client/cli/camera_matrices.h"
#include "client/cli/console.h"
#include "common/base/file.h"
#include "common/film/film_hash.h"
#include "common/image/cryptomatte.h"
#include "common/image/picture_file.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "lightmill/v1/scene.pb.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
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

Receipt receipt_of(const v1::FilmHeader& header) {
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
  const std::int64_t when =
      job.finished_unix_ms() != 0 ? job.finished_unix_ms() : std::int64_t{std::time(nullptr)} * 1000;
  receipt.capture_date = capture_date(when);
  return receipt;
}

/// What its objects and materials are called, for the id layer.
PictureIds ids_in(const Scene& scene) {
  std::vector<std::string> objects, materials;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    objects.push_back(object.name.empty() ? fmt::format("objects[{}]", i) : object.name);
    materials.push_back(scene.materials[object.material].name);
  }
  return {std::move(objects), std::move(materials)};
}

/// Where the camera of the scene was, in the attributes that OpenEXR has for it.
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

/// A film on its way here, and what its tiles must be like.
struct IncomingFilm {
  FetchedFilm film;
  TileGrid grid;
  NodeLayout layout;
  PictureIds ids;
};

Result<IncomingFilm> begin_film(const v1::FilmHeader& header) {
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
  IncomingFilm in{{header.job(), FilmPicture(frame, crop), {}}, grid_of(*settings), NodeLayout(settings->layers), {}};
  in.film.picture.receipt = receipt_of(header);
  LM_RETURN_IF_ERROR(add_camera_attributes(settings->scene, in.film.picture));
  for (const LayerSpec& layer : std::span(settings->layers).subspan(1)) {
    in.film.picture.layers.push_back(make_picture_layer(layer.name, in.film.picture.pixels()));
  }
  if (in.layout.first_samples > 0 || settings->meters > 0) {
    LM_ASSIGN_OR_RETURN(const Scene scene, unpack_scene(settings->scene));
    in.ids = ids_in(scene);
    for (const Meter& meter :
         std::span(scene.meters).first(std::min<std::size_t>(settings->meters, scene.meters.size()))) {
      in.film.meters.push_back({meter, {}});
    }
  }
  in.film.picture.receipt.meter_hashes.resize(in.film.meters.size());
  return in;
}

Status add_meter(IncomingFilm& in, std::uint32_t meter, const v1::FilmTile& tile, std::span<const float> sums) {
  if (meter >= in.film.meters.size() || sums.size() != in.layout.summed_values() * kTileSize * kTileSize ||
      tile.samples_a() > tile.samples()) {
    return data_loss("the farm sent {} sums of meter {} of {}", sums.size(), meter, in.film.meters.size());
  }
  NamedReading& reading = in.film.meters[meter];
  reading.reading = read_meter(reading.meter, sums, in.layout.summed, tile.samples());
  in.film.picture.receipt.meter_hashes[meter] =
      meter_hash(sums, tile.samples_a(), tile.samples() - tile.samples_a()).hex();
  return ok_status();
}

Status add_tile(IncomingFilm& in, const v1::FilmTile& tile) {
  FilmPicture& picture = in.film.picture;
  const ImageWindow rect = to_window(tile.rect());
  LM_ASSIGN_OR_RETURN(const std::vector<float> sums, floats_from_bytes(tile.sums()));
  if (const PixelRect place{rect.x, rect.y, rect.width, rect.height}; is_meter_rect(place)) {
    return add_meter(in, meter_of(place), tile, sums);
  }
  LM_ASSIGN_OR_RETURN(const std::vector<float> first, floats_from_bytes(tile.first()));
  if (!lies_within(rect, picture.data) ||
      sums.size() != in.layout.summed_values() * static_cast<std::size_t>(rect.pixel_count())) {
    return data_loss("the farm sent a tile at {},{} of {}x{} pixels with {} sums, outside the film", rect.x, rect.y,
                     rect.width, rect.height, sums.size());
  }
  if (tile.samples_a() > tile.samples()) {
    return data_loss("the farm sent a tile with {} of {} samples in half A", tile.samples_a(), tile.samples());
  }
  place_sums(picture, rect, tile.samples_a(), tile.samples() - tile.samples_a(), sums);
  if (tile.first_samples() > kFirstSamples ||
      !place_first_samples(picture.layers, picture.data, rect, tile.first_samples(), first, in.ids)) {
    return data_loss("the farm sent a tile with {} values of {} samples for its layers", first.size(),
                     tile.first_samples());
  }
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
  FilmPlanesView planes;
  planes.mean_a = picture.half_a;
  planes.mean_b = picture.half_b;
  planes.counts = counts;
  planes.meters = meters;
  for (const PictureLayer& layer : picture.layers) {
    planes.layers.emplace_back(layer.values);
  }
  return film_hash(planes);
}

Result<FetchedFilm> fetch_film(FarmConnection& connection, std::uint64_t id) {
  std::optional<IncomingFilm> in;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max(), most = 0;
  LM_RETURN_IF_ERROR(connection.get_film(id, [&](const v1::GetFilmResponse& part) -> Status {
    if (part.has_header()) {
      LM_ASSIGN_OR_RETURN(IncomingFilm begun, begin_film(part.header()));
      in.emplace(std::move(begun));
      return ok_status();
    }
    if (!in) {
      return data_loss("the farm sent a tile before the film's header");
    }
    least = std::min(least, part.tile().samples());
    most = std::max(most, part.tile().samples());
    return add_tile(*in, part.tile());
  }));
  if (!in || least > most) {
    return data_loss("the farm sent no film for job {}", id);
  }
  FilmPicture& picture = in->film.picture;
  picture.receipt.min_samples = least;
  picture.receipt.max_samples = most;
  picture.receipt.film_hash = film_hash_of(picture).hex();
  if (!in->film.meters.empty()) {
    picture.attributes["lightmill.meters"] = to_json(in->film.meters).dump();
  }
  if (in->layout.first_samples > 0) {
    add_id_attributes(picture.attributes, in->ids);
  }
  return std::move(in->film);
}

Status check_outputs(const std::vector<std::string>& paths) {
  std::set<fs::path> given;
  for (const std::string& text : paths) {
    const fs::path path(text);
    if (!given.insert(path.lexically_normal()).second) {
      return invalid_argument("-o {} is given twice", text);
    }
    LM_RETURN_IF_ERROR(picture_format(path).status());
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
      return invalid_argument("cannot write {}: there is no folder {}", text, folder.string());
    }
    if (fs::is_directory(path, error)) {
      return invalid_argument("cannot write {}: it is a folder", text);
    }
    if (const Status status = check_can_write(path); !status.ok()) {
      return invalid_argument("{}", message_of(status));
    }
  }
  return ok_status();
}

Status write_outputs(const FilmPicture& picture, const std::vector<std::string>& paths, const ViewSettings& view) {
  for (const std::string& path : paths) {
    LM_ASSIGN_OR_RETURN(const PictureFormat format, picture_format(path));
    LM_ASSIGN_OR_RETURN(const std::string bytes, encode_picture(picture, format, view));
    LM_RETURN_IF_ERROR(as_output_error(write_file_atomically(path, as_byte_view(bytes))));
  }
  return ok_status();
}

}  // namespace lightmill::cli

// Client of `lightmill-image-decoder`, a process that reads each image and each compressed mesh in a sandboxed child.
//
// Users upload such files, and the libraries that read them have faults. Some libraries even open files and addresses
// that an image names. The child has the file's bytes and a pipe for its pixels or arrays, and no other access to the
// machine (decoder/confined_child.h).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/decoder/compressed_mesh.h"
#include "common/image/decoder/decoder_protocol.h"
#include "common/image/image_size.h"
#include "common/image/texels.h"

namespace lightmill {

struct FromDecoder;

/// The decoder in the folder of this program.
std::filesystem::path image_decoder_program();

/// The decoder's description of its libraries (decoder/fingerprint.h). Takes about 0.3 s. FAILED_PRECONDITION if the
/// decoder does not start or fails, or if it does not end within `time_limit`. It is killed then.
Result<std::string> fingerprint_of_decoder(const std::filesystem::path& program, const Clock& clock,
                                           std::chrono::milliseconds time_limit = std::chrono::minutes(2));

struct DecoderOptions {
  std::filesystem::path program = image_decoder_program();
  bool unsandboxed = false;                                        ///< decode even if the kernel refuses the sandbox
  std::chrono::milliseconds time_limit = std::chrono::minutes(2);  ///< per image or mesh
};

/// Starts the process with the first file, and again after it was killed. The destructor ends it. Not thread-safe.
///
/// Errors begin with the image's name. INVALID_ARGUMENT: the file is at fault. RESOURCE_EXHAUSTED: it needs more than
/// this machine has or allows. FAILED_PRECONDITION: this machine cannot decode.
class DecoderProcess {
 public:
  explicit DecoderProcess(DecoderOptions options) : options_(std::move(options)) {}
  DecoderProcess(const DecoderProcess&) = delete;
  DecoderProcess& operator=(const DecoderProcess&) = delete;
  ~DecoderProcess() { stop(); }

  /// When a stop is requested, the file that is being read ends with CANCELLED, as do later ones.
  void set_stop(std::stop_token stop) { stop_ = std::move(stop); }
  /// Size as in the file's header.
  Result<ImageSize> size(ByteView bytes, const std::string& name);
  /// Decodes the bytes of an image file. `name` is only for messages, which begin with it. Files with 8 bits per
  /// channel give bytes, those with integers or half floats of 16 bits words, others floats. 8- and 16-bit integers count
  /// as encoded, floats as linear. Colours are not multiplied by alpha. Properties in the header that change pixels are
  /// applied (OpenedImage). Of several images or mip levels, the first is read. Fails for files that are no image, for
  /// more than `max_pixels` and for values that are not finite. Pixels are received while the next ones are decoded.
  Result<Texels> decode(ByteView bytes, const std::string& name, std::int64_t max_pixels = kMaxTexturePixels);
  /// Decodes the bytes of a compressed mesh, as a MeshDecoder does. The arrays are received while they are made.
  Result<DecodedMesh> decode_mesh(ByteView bytes, const MeshRequest& request);

  /// Id of the running process; 0 if there is none.
  pid_t pid() const { return pid_; }

 private:
  Status start();
  /// Kills the process if it runs. Returns how it ended, in words.
  std::string stop();
  /// Receives the decoder's data from the pipe. An error means that this data is invalid. If it returns OK, the
  /// decoder's reply decides.
  using Receive = std::function<Status(const FromDecoder&)>;
  /// Sends the request with the bytes. `receive` may be called twice. Errors of the reply are returned.
  Result<DecodeReply> ask(ByteView bytes, DecodeRequest request, const Receive& receive);
  Result<DecodeReply> exchange(const DecodeRequest& request, int file, const Receive& receive);

  const DecoderOptions options_;
  pid_t pid_ = 0;
  int socket_ = -1;
  std::stop_token stop_;
};

}  // namespace lightmill

// The decoder as programs use it: the real process, real files of every format, and its failures.
#include "common/image/decoder/decoder_process.h"

#include <gtest/gtest.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/sanitizers.h"
#include "common/image/exr.h"
#include "common/image/png.h"
#include "common/image/read/image_format.h"
#include "decoder/fingerprint.h"
#include "tests/support/draco_file.h"
#include "tests/support/image_files.h"
#include "tests/support/paths.h"
#include "tests/support/process.h"
#include "tests/support/read_image.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

DecoderOptions built() {
  return {.program = program("lightmill-image-decoder")};
}

std::string small_png() {
  const std::vector<std::uint8_t> rgb{255, 0, 0, 0, 255, 0, 0, 0, 255, 188, 188, 188};
  return *encode_png(2, 2, rgb);
}

TEST(DecoderProcess, EachFormatHasThePixelsThatItsReaderGives) {
  DecoderProcess decoder(built());
  for (const ImageFile& file : readable_image_files()) {
    const ByteView bytes = as_byte_view(file.bytes);
    const Result<Texels> here = read_image(bytes, file.format);
    ASSERT_TRUE(here.ok()) << here.status();
    EXPECT_EQ(here->width, 16) << file.format;
    const Result<Texels> there = decoder.decode(bytes, file.format);
    ASSERT_TRUE(there.ok()) << there.status();
    EXPECT_EQ(there->width, here->width) << file.format;
    EXPECT_EQ(there->height, here->height) << file.format;
    EXPECT_EQ(there->encoded, here->encoded) << file.format;
    EXPECT_TRUE(there->bytes == here->bytes) << file.format;
    EXPECT_TRUE(there->words == here->words) << file.format;
    EXPECT_EQ(there->half, here->half) << file.format;
    EXPECT_TRUE(there->floats == here->floats) << file.format;
    const Result<ImageSize> size = decoder.size(bytes, file.format);
    ASSERT_TRUE(size.ok()) << size.status();
    EXPECT_EQ(size->pixels() * size->bytes_per_pixel, size_bytes(*there)) << file.format;
  }
}

// Pixels come in pieces of a megabyte, and a pipe holds as much.
TEST(DecoderProcess, LargeImagesHaveAllTheirPixels) {
  constexpr int kSide = 700;
  DecoderProcess decoder(built());
  std::vector<std::uint8_t> rgb(3 * kSide * kSide);
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = static_cast<std::uint8_t>(i * i >> 7);
  }
  const Result<Texels> bytes = decoder.decode(as_byte_view(*encode_png(kSide, kSide, rgb)), "bytes");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  ASSERT_EQ(bytes->bytes.size(), rgb.size() / 3);
  for (std::size_t i = 0; i < bytes->bytes.size(); ++i) {
    const auto channel = [&](std::size_t c) { return std::uint32_t{rgb[3 * i + c]}; };
    ASSERT_EQ(bytes->bytes[i], channel(0) | channel(1) << 8 | channel(2) << 16 | 0xff000000u) << i;
  }
  Image image;
  image.display = image.data = {0, 0, kSide, kSide};
  std::vector<std::vector<float>> planes(3, std::vector<float>(kSide * kSide));
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < planes[channel].size(); ++i) {
      planes[channel][i] = static_cast<float>(4 * i + channel);
    }
    image.channels.push_back({std::string(1, "RGB"[channel]), planes[channel]});
  }
  const Result<Texels> floats = decoder.decode(as_byte_view(*encode_exr(image)), "floats");
  ASSERT_TRUE(floats.ok()) << floats.status();
  ASSERT_EQ(floats->floats.size(), std::size_t{4} * kSide * kSide);
  for (std::size_t i = 0; i < floats->floats.size(); ++i) {
    ASSERT_EQ(floats->floats[i], i % 4 == 3 ? 1 : planes[i % 4][i / 4]) << i;
  }
}

TEST(DecoderProcess, OtherFormatsAreRefusedUnderAnyName) {
  DecoderProcess decoder(built());
  std::vector<ImageFile> files = refused_image_files();
  files.push_back({"png", ""});
  for (const ImageFile& file : files) {
    for (const std::string& name : {"a." + file.format, std::string("a.png"), "http://127.0.0.1:9/a." + file.format}) {
      const std::string message = message_of(decoder.decode(as_byte_view(file.bytes), name).status());
      EXPECT_EQ(message, name +
                             ": not a readable image: its first bytes match none of the formats PNG, JPEG, OpenEXR, "
                             "Radiance HDR, TIFF, TGA, BMP, GIF, WebP, PNM, PFM, PSD and DDS");
      EXPECT_EQ(message_of(decoder.size(as_byte_view(file.bytes), name).status()), message);
    }
  }
}

TEST(DecoderProcess, TheSceneFormatsPageListsTheFormats) {
  const std::string page = read_file(source_file("docs/reference/scene.md")).value();
  EXPECT_NE(page.find(std::string("has one of these formats: ") + kImageFormats + "."), std::string::npos);
}

TEST(DecoderProcess, TruncatedFilesDoNotAffectTheNextFile) {
  DecoderProcess decoder(built());
  const std::string png = small_png();
  for (const ImageFile& file : readable_image_files()) {
    for (const std::size_t size : {std::size_t{1}, std::size_t{13}, file.bytes.size() / 2, file.bytes.size() - 1}) {
      const std::string cut = file.bytes.substr(0, size);
      const Result<Texels> texels = decoder.decode(as_byte_view(cut), "cut." + file.format);
      if (kSanitized && file.format == "png") {
        continue;  // libpng leaves a truncated file by a jump, which leaks a string of OpenImageIO's
      }
      const Result<Texels> here = read_image(as_byte_view(cut), "cut." + file.format);
      EXPECT_EQ(texels.status(), here.status()) << file.format << " " << size;
    }
    EXPECT_TRUE(decoder.decode(as_byte_view(png), "small.png").ok());
  }
}

TEST(DecoderProcess, AKilledDecoderIsRestarted) {
  DecoderProcess decoder(built());
  const std::string png = small_png();
  EXPECT_EQ(decoder.pid(), 0);
  ASSERT_TRUE(decoder.decode(as_byte_view(png), "small.png").ok());
  const pid_t first = decoder.pid();
  ASSERT_EQ(::kill(first, SIGKILL), 0);
  ASSERT_TRUE(decoder.decode(as_byte_view(png), "small.png").ok());
  EXPECT_NE(decoder.pid(), first);
}

TEST(DecoderProcess, AStopEndsTheImageThatIsRead) {
  const std::string image = small_png();
  DecoderProcess decoder(built());
  ASSERT_TRUE(decoder.decode(as_byte_view(image), "first").ok());
  std::stop_source stop;
  decoder.set_stop(stop.get_token());
  ASSERT_EQ(::kill(decoder.pid(), SIGSTOP), 0);  // reading the image would never end
  std::jthread other([&, reader = ::gettid()] {
    const std::string state = fmt::format("/proc/self/task/{}/stat", reader);
    EXPECT_TRUE(eventually([&] { return read_file(state)->find(") S ") != std::string::npos; })) << "it must wait";
    stop.request_stop();
  });
  EXPECT_EQ(decoder.decode(as_byte_view(image), "second").status().code(), StatusCode::kCancelled);
  EXPECT_EQ(decoder.decode(as_byte_view(image), "third").status().code(), StatusCode::kCancelled);
  decoder.set_stop({});
  EXPECT_TRUE(decoder.decode(as_byte_view(image), "fourth").ok());
}

TEST(DecoderProcess, EndsWithTheObjectThatStartedIt) {
  pid_t pid = 0;
  {
    DecoderProcess decoder(built());
    ASSERT_TRUE(decoder.decode(as_byte_view(small_png()), "small.png").ok());
    pid = decoder.pid();
  }
  EXPECT_EQ(::kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

TEST(DecoderProcess, ErrorsNameTheLimit) {
  const std::string large = *encode_png(64, 64, std::vector<std::uint8_t>(3 * 64 * 64, 9));
  DecoderProcess decoder(built());
  const Status pixels = decoder.decode(as_byte_view(large), "a.png", 4095).status();
  EXPECT_EQ(pixels.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(pixels),
            "a.png: 64x64 pixels are more than the worker's limit of 0.003905 megapixels (--image-megapixels)");
}

TEST(DecoderProcess, AMissingDecoderIsReported) {
  DecoderProcess decoder({.program = "/nowhere/lightmill-image-decoder"});
  const Status status = decoder.decode(as_byte_view(small_png()), "small.png").status();
  EXPECT_EQ(status.code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(message_of(status),
            "small.png: cannot start /nowhere/lightmill-image-decoder: No such file or directory. "
            "Install it beside this program");
  DecoderProcess wrong({.program = "/bin/false"});
  EXPECT_EQ(
      message_of(wrong.decode(as_byte_view(small_png()), "small.png").status()),
      "small.png: cannot decode it: /bin/false was started twice and ended (exit code 1). Run it by hand to see why");
}

std::string text_of(pid_t process, const std::string& file) {
  return read_file(fmt::format("/proc/{}/{}", process, file)).value();
}

TEST(DecoderProcess, HasNeitherRightsNorSecretsOfItsCaller) {
  ::setenv("LIGHTMILL_TOKEN", "a-secret", 1);
  DecoderProcess decoder(built());
  ASSERT_TRUE(decoder.decode(as_byte_view(small_png()), "small.png").ok());
  ::unsetenv("LIGHTMILL_TOKEN");
  if (::geteuid() != 0) {
    GTEST_SKIP() << "only root has rights that the decoder gives up";
  }
  EXPECT_EQ(text_of(decoder.pid(), "environ").find("a-secret"), std::string::npos);
  EXPECT_NE(text_of(decoder.pid(), "environ").find("LD_BIND_NOW=1"), std::string::npos);
  const std::string status = text_of(decoder.pid(), "status");
  EXPECT_NE(status.find("Uid:\t65534\t65534\t65534\t65534\n"), std::string::npos) << status;
  EXPECT_NE(status.find("Gid:\t65534\t65534\t65534\t65534\n"), std::string::npos) << status;
  EXPECT_NE(status.find("Groups:\t \n"), std::string::npos) << status;
  EXPECT_NE(status.find("CapPrm:\t0000000000000000\n"), std::string::npos) << status;
}

/// The text that `work` returns in a child of this process.
std::string said_by_child(const std::function<std::string()>& work) {
  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const std::string text = work();
    ::_exit(::write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size()) ? 0 : 1);
  }
  ::close(ends[1]);
  std::string text(4096, '\0');
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(::read(ends[0], text.data(), text.size()), 0)));
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  return text;
}

std::string decoded_or_why(const DecoderOptions& options) {
  DecoderProcess decoder(options);
  const Status status = decoder.decode(as_byte_view(small_png()), "small.png").status();
  return status.ok() ? "decoded" : message_of(status);
}

TEST(DecoderProcess, DecodesForARootWithoutCapabilities) {
  EXPECT_EQ(said_by_child([] {
              for (int capability = 0; ::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) == 0; ++capability) {
              }
              __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
              std::array<__user_cap_data_struct, 2> none{};
              LM_CHECK(::syscall(SYS_capset, &header, none.data()) == 0);
              return decoded_or_why(built());
            }),
            "decoded");
}

/// Makes the system call seccomp refuse new filters of this process and its children, as systemd's units do.
void refuse_seccomp_call() {
  std::array<sock_filter, 4> steps{sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)},
                                   sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, __NR_seccomp},
                                   sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ERRNO | EPERM},
                                   sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW}};
  const sock_fprog program{steps.size(), steps.data()};
  LM_CHECK(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0);
}

/// Makes prctl refuse them, too.
void refuse_seccomp() {
  refuse_seccomp_call();
  std::array<sock_filter, 6> steps{sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)},
                                   sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 3, __NR_prctl},
                                   sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, args[0])},
                                   sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, PR_SET_SECCOMP},
                                   sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ERRNO | EPERM},
                                   sock_filter{BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW}};
  const sock_fprog program{steps.size(), steps.data()};
  LM_CHECK(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0);
}

TEST(DecoderProcess, DecodesWhereOnlyPrctlInstallsFilters) {
  EXPECT_EQ(said_by_child([] {
              refuse_seccomp_call();
              return decoded_or_why(built());
            }),
            "decoded");
}

std::string mesh_decoded_or_why(const DecoderOptions& options) {
  DecoderProcess decoder(options);
  const DracoSource grid = draco_grid(3);
  const std::string file = draco_file(grid, DracoMethod::edgebreaker);
  const Status status = decoder.decode_mesh(as_byte_view(file), request_for(grid)).status();
  return status.ok() ? "decoded" : message_of(status);
}

TEST(DecoderProcess, RefusesImagesAndMeshesWithoutSeccompUnlessAllowed) {
  const std::string refusal =
      "the kernel refuses the sandbox (seccomp): Operation not permitted; allow seccomp, or trust the senders of scenes "
      "and give --unsandboxed-images\ndecoded\n";
  EXPECT_EQ(said_by_child([] {
              refuse_seccomp();
              DecoderOptions trusting = built();
              trusting.unsandboxed = true;
              return fmt::format("{}\n{}\n{}\n{}\n", decoded_or_why(built()), decoded_or_why(trusting),
                                 mesh_decoded_or_why(built()), mesh_decoded_or_why(trusting));
            }),
            "small.png: " + refusal + refusal);
}

TEST(DecoderProcess, ItsFingerprintCoversThePixelsAndMeshesOfItsLibraries) {
  const Result<std::string> fingerprint = fingerprint_of_decoder(program("lightmill-image-decoder"), system_clock());
  ASSERT_TRUE(fingerprint.ok()) << fingerprint.status();
  EXPECT_EQ(fingerprint->size(), 16u);
  EXPECT_EQ(*fingerprint, decoder_fingerprint().value()) << "the same libraries in this process";
  EXPECT_EQ(fingerprint_of_decoder("/nowhere/lightmill-image-decoder", system_clock()).status().code(),
            StatusCode::kFailedPrecondition);
}

TEST(DecoderProcess, AFingerprintThatDoesNotComeEndsWithAnError) {
  const TemporaryFolder folder;
  const auto asked = [&](const std::string& name, const std::string& does) {
    const std::filesystem::path program = folder.path() / name;
    std::ofstream(program) << "#!/bin/sh\n" << does << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return message_of(fingerprint_of_decoder(program, system_clock(), std::chrono::milliseconds(200)).status());
  };
  const std::string hangs = folder.path().string() + "/hangs";
  EXPECT_EQ(asked("hangs", "sleep 1000; true"),
            hangs + " --fingerprint did not end within 0.2 s: run it by hand to see why, then start this again");
  EXPECT_NE(asked("stays", "echo 0123456789abcdef; exec sleep 1000 >&-").find("did not end"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test

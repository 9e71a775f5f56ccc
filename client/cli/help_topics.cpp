#include "client/cli/help_topics.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "client/cli/table.h"
#include "common/command_line/help_page.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill::cli {
namespace {

void print_text(const Console& console, std::string_view text) {
  std::string lines = text_for_terminal(text);
  lines.pop_back();  // the final line feed
  console.result(lines);
}

void explain_access(const Console& console) {
  print_text(
      console,
      "A farm with a certificate requires authentication. With the certificate of its authority (ca.pem), a program "
      "checks the coordinator and encrypts the connection. Your own certificate or token says who you are. If "
      "you give both, the token counts.\n\n");
  print_table(console, {{"OPTION", "VARIABLE", "MEANS"},
                        {"--tls-ca FILE", "LIGHTMILL_TLS_CA", "the authority of the coordinator's certificate"},
                        {"--tls-cert FILE", "LIGHTMILL_TLS_CERT", "your certificate"},
                        {"--tls-key FILE", "LIGHTMILL_TLS_KEY", "its private key, if it is in a file of its own"},
                        {"--token-file FILE", "LIGHTMILL_TOKEN_FILE", "a file with your token"},
                        {"", "LIGHTMILL_TOKEN", "your token itself"}});
  console.result("");
  print_table(console, {{"ROLE", "MAY"},
                        {"view", "see all jobs, pictures and workers"},
                        {"submit", "submit jobs; see and change its own; see the workers"},
                        {"operate", "all that with the jobs of all users; drain, quarantine and release workers"},
                        {"worker", "get work and send results"},
                        {"admin", "all but render and enrol; make, list and revoke tokens; read the log"},
                        {"enrol", "get a token with the role worker (lightmill tokens create NAME --enrol N)"}});
  print_text(console,
             "\n`lightmill certs` makes certificates, and `lightmill tokens` makes tokens.\n\n"
             "  lightmill jobs --server farm.example:7350 --tls-ca ca.pem --tls-cert ada.pem");
}

void explain_audits(const Console& console) {
  print_text(
      console,
      "An audit renders a result again on a worker of another identity, and compares the bits. The identity is the "
      "worker's certificate or token. Without these it is the machine. If the bits differ, a third identity decides. "
      "The worker with the wrong result enters quarantine, and the farm renders its results again.\n\n"
      "--audit sets the share of a job's results that are audited: 1% (the default), 0.1%, all or none. `lightmill "
      "show JOB` says how many were audited. If none was, it says why.\n\n"
      "Workers with the same bits in a test render have the same fingerprint class. A job uses workers of one class. "
      "With --allow-mixed it uses workers of all classes. Then the bits of its picture depend on the workers. "
      "`lightmill verify` cannot check such a picture, and audits compare results of one class only.");
}

void explain_exit_codes(const Console& console) {
  print_table(
      console,
      {{"CODE", "MEANS"},
       {"0", "done"},
       {"1", "the job failed, was cancelled or is gone, a check found a difference, or writing a result failed"},
       {"2",
        "bad usage or bad input, an unknown job or worker, a role that you lack, or a place where no file can be written"},
       {"3", "the farm is unreachable or full, or the job has no picture yet: try again later"},
       {"130", "interrupted"}});
}

void explain_farm(const Console& console) {
  print_text(console,
             "A command uses the farm of --server, else that of LIGHTMILL_SERVER, else the one at 127.0.0.1:7350. "
             "Several addresses, separated by commas, are the active coordinator and its standbys: A:7350,B:7350. If "
             "quickstart.sh runs a farm at another port in the current folder or above it, a notice says so.\n\n"
             "`render`, `verify` and `lab` need no farm. If no address is given and no farm answers at "
             "127.0.0.1:7350, they start a local farm. They stop it at the end. --local always starts one.\n\n"
             "Ctrl-C in `render` cancels the job. Its picture can still be fetched. With a local farm, Ctrl-C writes "
             "the picture so far to the -o files, if every part has a sample. Ctrl-C in `watch` leaves the job "
             "running. If a farm goes away, both retry for ten minutes.\n\n"
             "  lightmill render scene.json --local --threads 4\n"
             "  LIGHTMILL_SERVER=farm.example:7350 lightmill jobs");
}

void explain_layers(const Console& console) {
  print_text(console, "--layers adds layers to the EXR. They do not change the picture.\n\n");
  print_table(
      console,
      {{"LAYER", "CHANNELS", "CONTENTS"},
       {"direct", "Direct.R/G/B", "light that was scattered at most once"},
       {"indirect", "Indirect.R/G/B", "all other light"},
       {"caustic", "Caustic.R/G/B", "the part of indirect that arrives from casters: mirrors, glass and smooth metal"},
       {"bias", "Bias.R/G/B", "an estimate of the bias: the picture minus one with half the gather radius"},
       {"light:NAME", "Light.NAME.R/G/B", "light of the light group NAME; Light.rest has all other light"},
       {"albedo", "Albedo.R/G/B", "the reflectance of the first surface"},
       {"normal", "N.X/Y/Z", "the shading normal of the first surface, in scene coordinates"},
       {"features", "Features.A/B...", "sums of albedo, normal and 1/depth, for --denoise"},
       {"depth", "Z", "the distance of the first surface from the camera's plane, in scene units"},
       {"id", "CryptoObject.., CryptoMaterial..", "objects and materials as Cryptomatte"}});
  console.result("");
  print_table(console, {{"METHOD", "LAYERS"},
                        {"caustic", "all"},
                        {"auto, path, vcm", "all but caustic"},
                        {"ppm", "bias, albedo, normal, features, depth, id"},
                        {"others", "albedo, normal, features, depth, id"}});
}

void explain_denoise(const Console& console) {
  print_text(
      console,
      "--denoise reconstructs a picture with less noise. It fits simple models of the surfaces to the samples "
      "around each pixel. It helps most at few samples per pixel. It blurs what the models miss, "
      "such as caustics, reflections and fine shadows.\n\n"
      "`render --denoise` and `submit --denoise` add the layer \"features\" to the job. `render`, `fetch` and "
      "`watch` with --denoise write the reconstructed picture to PNG files. In EXR files it is Denoised.R/G/B, "
      "beside the raw picture. The page shows the reconstructed picture of such a job while it renders. The film on "
      "the farm stays as it is.\n\n"
      "The stated error is that of the raw picture. The error of the denoised picture is not known.\n\n"
      "  lightmill render scene.json --spp 16 --denoise\n"
      "  lightmill submit scene.json --denoise\n"
      "  lightmill fetch 5 --denoise -o picture.png");
}

void explain_limits(const Console& console) {
  print_text(console,
             "A job stops at the first limit that it reaches. Without a limit it gets 64 samples per pixel.\n\n");
  print_table(console, {{"OPTION", "THE JOB STOPS"},
                        {"--spp N", "at N samples per pixel"},
                        {"--seconds T", "after T of rendering (90, 1.5m, 2h), with a sample for each pixel"},
                        {"--error E", "when the error (relMSE) is at most E, with 95% confidence"}});
  print_text(
      console,
      "\nAn error is checked when each pixel has 2^k or 3·2^k samples, from 16. The counts follow from the film "
      "alone, so a job stops with the same picture on any farm. "
      "An error of 0.01 is ±10% and slightly noisy, 0.001 is ±3% and smooth.\n\n"
      "With --adaptive, a pilot measures the noise first. Then noisy tiles get up to 4 times the samples, "
      "and smooth tiles down to a quarter. The average stays the same. The pilot's samples do not enter the "
      "picture.\n\n"
      "`lightmill extend JOB` raises the samples or lowers the error, also of a finished job. A time limit cannot be "
      "extended.");
}

void explain_measures(const Console& console) {
  print_text(console, "`lightmill error` compares a picture x with a reference r.\n\n");
  print_table(console, {{"NUMBER", "MEANS"},
                        {"relMSE", "the mean of (x-r)²/(r²+0.01)"},
                        {"trimmed", "the same without the worst 0.1% of the pixels"},
                        {"energy ratio", "the sum of x over the sum of r. --json also has that of each channel"},
                        {"SMAPE", "the mean of |x-r|/(|x|+|r|)"},
                        {"FLIP", "how different they look, from 0 to 1: the mean over the pixels"},
                        {"HDR-FLIP", "the same at the worst of several exposures"},
                        {"largest", "the largest difference"}});
  print_text(console, "\nA PNG is made linear first. It lacks values above white, and differences below 1/255.");
}

void explain_methods(const Console& console) {
  Rows rows{{"METHOD", "SHOWS", "PARAMETERS"}};
  for (const MethodDescription& about : method_descriptions()) {
    std::string parameters(about.parameters);  // all have brute-force as the last one; the second table says so
    parameters.erase(std::min(parameters.rfind(", brute-force"), parameters.rfind("brute-force")));
    rows.push_back({std::string(about.name), std::string(about.summary), std::move(parameters)});
  }
  print_table(console, rows);
  console.result("");
  print_table(
      console,
      {{"PARAMETER", "MEANS"},
       {"photons=N", "photons per pass. A pass adds one sample to each pixel (default: 1 per 16 pixels; vcm: 1 per 4)"},
       {"radius=C", "gather radius of the first pass, in pixels (default: 1.5; vcm: 0.5; ppm: 3)"},
       {"caustic", "only photons that have met a caster (mirror, glass, smooth metal) first"},
       {"no-absorption", "media inside shapes absorb no light"},
       {"distance=D", "maximum distance of occluders, in scene units (default: unlimited)"},
       {"flat", "shades with geometric normals"},
       {"glass=R", "constant reflectance of smooth glass, instead of Fresnel's equations"},
       {"brute-force", "all methods: test every triangle for every ray, to measure what the BVH saves"}});
  print_text(console, "\n  lightmill render scene.json --method caustic:photons=50000,radius=1 -o picture.exr");
}

void explain_output(const Console& console) {
  print_text(console,
             "Results go to standard output. Progress, notices and errors go to standard error. With --json a command "
             "prints one JSON object, and no progress.\n\n");
  print_table(console, {{"OUTPUT TO", "HAS THE WIDTH"},
                        {"a terminal", "of the terminal"},
                        {"a pipe or a file", "of its longest line: nothing is wrapped, shortened or left out"},
                        {"either, with the variable COLUMNS", "that COLUMNS says, from 20 to 10000"}});
  print_text(
      console,
      "\nHelp pages have at most 100 columns. `lightmill top` and the line of progress fill the terminal, and no "
      "more. The variable NO_COLOR turns colours off.\n\n"
      "  COLUMNS=120 lightmill jobs >jobs.txt");
}

void explain_receipts(const Console& console) {
  print_text(console,
             "Each EXR has a receipt. It holds the scene, assets, method, seed, layers and fingerprint class of its "
             "render. It also holds hashes of its pixels. `lightmill verify` checks three things:\n\n");
  print_table(console, {{"CHECK", "FINDS"},
                        {"the file", "damaged, truncated and edited files"},
                        {"the receipt", "a receipt of another scene, camera, method or seed"},
                        {"random tiles, rendered again", "pixels that were forged or computed wrongly"}});
  print_text(
      console,
      "\n--share sets the share of the tiles that are rendered again. If a share w of the tiles is wrong, n random "
      "tiles miss all of them with probability (1 - w)^n. Each tile is a job of its own. Methods with photons "
      "or light paths trace all photons or light paths in each of these jobs.\n\n"
      "The workers must have the renderer version and the fingerprint class of the picture. If the job of the "
      "picture allowed mixed classes, only the file is checked.\n\n"
      "  lightmill verify picture.exr scene.json --share 5%");
}

void explain_scenes(const Console& console) {
  print_table(console, {{"SCENE", "IS"},
                        {"FILE.json", "a scene document; `scenes/NAME` stands for scenes/NAME.json"},
                        {"FILE.obj...", "one or several Wavefront files, with their .mtl files"},
                        {"FILE.gltf, FILE.glb", "glTF 2.0"},
                        {"FILE.ply, FILE.stl", "one mesh, with the colours of its vertices (PLY)"},
                        {"FILE.pbrt", "a scene of pbrt-v4, with the files that it includes"},
                        {"FILE.xml", "a scene of Mitsuba 3, with the files that it includes"},
                        {"FILE.blend", "read by Blender: the `blender` on the PATH, or that of LIGHTMILL_BLENDER"}});
  console.result("");
  print_table(
      console,
      {{"OPTION", "MEANS"},
       {"--camera NAME", "the file's camera with this name, or with this number, from 1"},
       {"--camera FILE", "a JSON file with a camera, as `lightmill check --save-camera` writes it"},
       {"--camera auto", "a view of everything from the front, above and right. Scenes without a camera get it"},
       {"--sky auto",
        "OBJ, glTF, PLY and STL files without a light source get a soft sky, brightest on the upper left"},
       {"--sky on, --sky off", "every scene gets a uniform white sky, or none"},
       {"--at SECONDS", "a glTF file at this moment of its first animation, or of the one given by --animation"},
       {"--mtl course", "Ka in MTL files is emission. The default if only some materials have Ka, and none has Ke"},
       {"--mtl standard", "Ka is ambient light, which is ignored"},
       {"--strict", "files with faults are refused. Without it, a notice names each kind of fault"}});
  print_text(console, "\n`lightmill check SCENE` shows what is in a scene, and what is wrong with it.");
}

constexpr std::array<HelpTopic, 12> kTopics{{
    {"access", "certificates, tokens and roles", explain_access},
    {"audits", "how the farm checks its workers", explain_audits},
    {"denoise", "pictures with less noise", explain_denoise},
    {"exit-codes", "exit codes of all commands", explain_exit_codes},
    {"farm", "which farm a command uses, and what Ctrl-C does", explain_farm},
    {"layers", "layers of EXR files", explain_layers},
    {"limits", "when a job stops", explain_limits},
    {"measures", "numbers that compare two pictures", explain_measures},
    {"methods", "rendering methods and their parameters", explain_methods},
    {"output", "standard output, its width, and colours", explain_output},
    {"receipts", "what `lightmill verify` finds", explain_receipts},
    {"scenes", "scene files, cameras and skies", explain_scenes},
}};

}  // namespace

std::span<const HelpTopic> help_topics() {
  return kTopics;
}

std::vector<std::string_view> help_topic_names() {
  std::vector<std::string_view> names;
  std::ranges::transform(kTopics, std::back_inserter(names), &HelpTopic::name);
  return names;
}

}  // namespace lightmill::cli

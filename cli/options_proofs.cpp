// Options of the commands on proofs.
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "cli/within.hpp"

namespace tiltrim::cli {

CLI::App* add_check_proof(CLI::App& app, CheckProofCommand& command) {
  CLI::App* check = app.add_subcommand(
      "check-proof", "verify a certificate of a proof independently of the program that made it");
  check->add_option("certificate", command.common.study, "the certificate")
      ->type_name("FILE")
      ->required();
  check->add_option("--study", command.about, "also check that all its numbers match this study")
      ->type_name("STUDY.toml");
  add_threads(check, command.threads);
  add_output(check, command.common);
  return check;
}

CLI::App* add_prove(CLI::App& app, ProveCommand& command) {
  CLI::App* prove = app.add_subcommand(
      "prove", "prove trim and stability for every value of the study's [[prove.parameter]]");
  add_study(prove, command.common, true);
  add_formats(prove, command.common, {"text", "json"},
              "text (default), or json with every digit; if omitted, the ending of FILE decides");
  add_output_file(prove, command.common, "FILE",
                  "write the output to this file (never a partial file)");
  add_only(prove, command.common);
  prove
      ->add_option("--margin", command.margin,
                   "decay rate to prove, 1/s (default: the study's, or 0)")
      ->check(within(0.0, 1e3))
      ->type_name("SIGMA");
  prove
      ->add_option("--damping", command.damping,
                   "damping ratio to prove as well (default: the study's, or any)")
      ->check(within(0.0, 0.99))
      ->type_name("ZETA");
  CLI::Option* largest = prove->add_flag("--largest-margin", command.largest,
                                         "find the largest decay rate that can be proved");
  prove
      ->add_option("--boxes", command.boxes,
                   "maximum number of boxes (default: the study's, or 20000)")
      ->check(within(1L, 100'000'000L))
      ->type_name("N");
  prove
      ->add_option("--certificate", command.certificate,
                   "write the certificate, with the evidence for every box, to this file")
      ->type_name("FILE");
  prove
      ->add_option("--log", command.log,
                   "log of examined boxes, from which a stopped or killed run resumes")
      ->type_name("FILE")
      ->excludes(largest);
  add_threads(prove, command.threads);
  return prove;
}

}  // namespace tiltrim::cli

#pragma once

#include <tandem/studies/commands/command.hpp>

/// Every command, in the order of `tandem --help`: its name, which is that of the file that defines it, and what it does.
/// `tandem` itself has what a first estimate takes; `tandem-more` has the others, which it need not wait for.
// clang-format off
#define TANDEM_COMMANDS(tandem, more)                                                                     \
  tandem(estimate, "Estimate the trajectories of chaser and target of a scenario")                        \
  more(navigate, "Estimate the chaser's own trajectory from its own raw sensors")                         \
  more(track, "Track chaser and target line by line, as data come, over a sliding window")                \
  more(compare, "Run every solver on a scenario: no, soft and hard constraints")                          \
  more(models, "Compare motion models of the target on a scenario, in one table")                         \
  more(calibrate, "Learn the noise of sensors and of motion from recordings, without truth")              \
  more(plan, "Plan the chaser's motion against the target's predicted one")                               \
  more(rendezvous, "Simulate rendezvous: sense, estimate, plan, act, until docked")                       \
  more(study, "Monte Carlo over a grid of parameters, models, solvers and seeds")                         \
  more(solve, "Solve a problem that estimate or navigate has written, or a program")                      \
  more(report, "A page about a study or a run, to be opened in a browser")                                \
  more(demo, "Run a small example, of the paper's pictures: fig3, table1, fig1, fig6 or fig7")            \
  more(simulate, "Write a made-up scenario folder: dive or docking")                                      \
  tandem(scenarios, "List the built-in scenarios")
// clang-format on

/// The lines of the list as ListedCommands: a program's own, and those that another has.
#define TANDEM_OWN(name, summary) {#name, summary, name##_command(), ""},
#define TANDEM_OF_TANDEM(name, summary) {#name, summary, {}, "bin/tandem"},
#define TANDEM_OF_MORE(name, summary) {#name, summary, {}, "libexec/tandem-more"},

namespace tandem {

#define TANDEM_DECLARE(name, summary) Command name##_command();
TANDEM_COMMANDS(TANDEM_DECLARE, TANDEM_DECLARE)

}  // namespace tandem

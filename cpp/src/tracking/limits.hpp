// Numbers that decide where a frame is looked for, and what it is matched with.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

#include "nacre/types.hpp"

// clang-format off
namespace nacre::tracking_limits {

constexpr std::size_t most_target_points = 30000;  // [points] budget: that a frame is registered to; benchmarks/run.py
constexpr double view_margin = 1.0 / 3.0;  // [image] tuned: on each side of it, that points to register a frame to may be in; teddy
constexpr int most_slides = 3;  // [1] budget: of a registration, along the direction of which the shapes tell least; test_open_directions
constexpr double largest_reach = 0.03;  // [size] tuned: of matches, in diameters of the smaller surface; bunny12
constexpr double reach_spacings = 1.5;  // [spacing] tuned: of matches along the surface; scans
constexpr double narrow_gate = 4.0;  // [reach] tuned: of matches at first, from a guess that is about right, and at the end of a search; teddy, dog
constexpr std::size_t last_outline_points = 2000;  // [points] budget: of the last view's outline; fandisk12
constexpr std::size_t outline_points = 600;  // [points] budget: of the frame's outline; fandisk12
constexpr std::size_t most_bright_points = 100000;  // [points] budget: of a frame's colours; test_color_registration
constexpr std::size_t num_finalists = 3;  // [guesses] budget: of those around earlier poses that are registered in full; test_failure
constexpr std::size_t num_semifinalists = 28;  // [guesses] budget: of those, that are tried with more than a few points; test_failure
constexpr int first_samples = 100;  // [points] budget: with which all of them are tried; test_failure
constexpr double beside_turn = 0.15;  // [rad] derived: between cameras beside a known one: a registration turns by as much; test_tracking
constexpr double least_new_view = 0.1;  // [view_distance] tuned: between views of a place that count: noise makes no new view; test_relocalisation_filter
constexpr double largest_gap = 0.2;  // [view_distance] tuned: between a place as registered and as followed; test_relocalisation_filter
constexpr double least_followed = 0.5;  // [1] tuned: overlap of a frame with the one before; test_frame_odometry
constexpr double odometry_error = 0.25;  // [1] tuned: of a step from frame to frame, beside what noise makes of it: 4 of 645 steps err by more; test_frame_odometry
constexpr double unseen_speed = 2.0;  // [1] budget: of a camera while images show nothing, against the fastest that was seen; test_frame_odometry
constexpr double least_unseen_step = 0.25;  // [view_distance] budget: from one of these to the next, that hands may make at any rate; test_frame_odometry
constexpr Eigen::Index most_object_samples = 2000;  // [points] budget: of an object on its plane; dog
constexpr int num_turns = 72;  // [1] budget: from which the search on the plane starts; dog
constexpr std::size_t num_turn_candidates = 10;  // [motions] budget: of them, that are refined; dog
constexpr Eigen::Index coarse_turn_samples = 300;  // [points] budget: of the search's start; dog
constexpr int most_coarse_steps = 14;  // [steps] budget: of a registration that finds the way alone; dog
constexpr int most_open_steps = 40;  // [steps] budget: along an open direction, one way, where a narrow gate of the user's makes them short; test_orbit
constexpr int most_turn_steps = 30;  // [steps] budget: of both; dog
constexpr double least_climb_step = 0.1;  // [tolerance] budget: of the search by outlines, halved until then; dog
constexpr int most_climb_rounds = 8;  // [rounds] budget: with steps of one length; dog
constexpr double climb_lever = 3.0;  // [1/size] derived: turns by what shifts a point at a third of the size as far; dog
constexpr double likeness_squares = 100.0;  // [squares] tuned: of what a frame shows, within which brightness is compared; test_likeness
constexpr int least_in_square = 8;  // [points] derived: that tell a correlation to 1 / sqrt(8); test_likeness

constexpr double even_odds = 0.092;  // [1] tuned: score of a registration that is right or wrong with the same probability; test_probability
constexpr double right_on_plane = 0.9;  // [1] tuned: part of the views found by the search on the plane that are right: 63 of 70; benchmarks/turned_on_plane.py
constexpr double odds_power = 3.13;  // [1] tuned: of the score, by which the odds grow; test_probability

constexpr int most_cells = 5000;  // [cells] budget: of an image in which things move; benchmarks/run.py
constexpr int largest_cell = 24;  // [pixel] budget: their side; benchmarks/run.py
constexpr Eigen::Index most_judged_points = 8000;  // [points] budget: of the model, that tell what has moved away; benchmarks/run.py
constexpr double least_in_view = 0.85;  // [1] tuned: of a frame, in the image of the scene, until that is renewed; test_moving_things
constexpr double most_moving = 0.67;  // [1] tuned: part of a frame: what most of it shows is the scene; test_moving_things
constexpr double clearly_better = 0.93;  // [1] tuned: score by that of another account of the frame (what stays, what outlines say) that from more on is no better; test_moving_things
constexpr int least_around = 5;  // [cells] tuned: of nine, a cell and those around it, that are judged; test_moving_things
constexpr double least_core = 0.01;  // [1] tuned: part of the image where a thing, and around it, was seen through; test_moving_things
constexpr double least_staying = 0.9;  // [1] tuned: part of a thing that stays as it is in the image, which the camera carries; test_carried_things
constexpr double nearer_than_scene = 0.5;  // [1] tuned: its median depth by the image's; test_carried_things
constexpr double most_asked_pixels = 20000.0;  // [pixels] budget: of a view, whether another one conflicts with it; benchmarks/run.py
constexpr double conflict_reach = 0.15;  // [depth] tuned: of the surroundings of conflicts, which what moves may fill; test_moving_things
constexpr double unexplained_conflicts = 0.1;  // [1] tuned: part of the conflicts with the last view that is left at most where the camera's motion explains them: edges of what it went around; test_orbit
constexpr int least_conflicts = 6;  // [points] tuned: in a cell of half that size, that crowd; test_moving_things
constexpr double fewer_conflicts = 2.0;  // [sigma] derived: of the difference of two counts, that is no chance; test_moving_things
constexpr int squares_across = 40;  // [1] tuned: of an image, three of which a thing is large, that has moved away; test_moving_things

constexpr double noise_per_residual = 1.376;  // [1] derived: standard deviation by median absolute value, of Laplace's distribution; test_residual_noise
constexpr double largest_noise_factor = 16.0;  // [1] budget: of the noise that is tried until it is known; d435-t265-shelf
constexpr double least_residual_sigmas = 0.5;  // [sigma] derived: that confirm a noise that was tried: with half of it the frame had been lost; unrelated
constexpr double telling_motion = 3.0;  // [pixel] tuned: by which a frame sees with other pixels than one before; test_residual_noise
constexpr std::size_t telling_frames = 30;  // [frames] budget: so long ago; test_residual_noise
constexpr double sticking_motion = 8.0;  // [pixel] tuned: within which errors that stay in the image may hold a camera: as far as neighbours share them; test_open_directions
constexpr double enough_frames = 5.0;  // [frames] tuned: that tell how noisy registered frames are, and what they contradict; unrelated
constexpr std::int64_t least_judged = 20;  // [points] derived: that tell a part of all; test_tracking

}  // namespace nacre::tracking_limits
// clang-format on

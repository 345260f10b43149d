% A block of trials: octave-cli trials.m TOKEN_FILE, with a server that was started as
%   palpate serve --device NAME --protocol P.json --db study.db --participant P01 --token-file TOKEN_FILE
% and a protocol with a block of the task "external". Writes a table of the trials.
arguments = argv ();
addpath (fileparts (mfilename ("fullpath")));
hand = palpate ("open", arguments{end});
due = hand.server.record.next;
printf ("trial,stimulus,response,correct,response_time\n");
while (! isempty (due))
  shown = due.stimuli{randi (numel (due.stimuli))};
  do  % a trial whose forces went off is shown again
    try
      palpate (hand, "start", struct ("stimulus", shown, "renderer", "ray", "trial", due.trial));
      answer = due.answers{1};  % here the experiment asks: input, KbWait, a figure with buttons
      trial = palpate (hand, "answer", struct ("response", answer));
      done = true;
    catch problem
      done = false;
      fprintf (stderr, "%s\n", problem.message);
      if (strcmp (problem.identifier, "palpate:emergency"))
        pause (0.5);  % it is cleared where it was raised, or at the server
      elseif (any (strcmp (problem.identifier, {"palpate:forces-off", "palpate:stopped", "palpate:nothing-felt"})))
        input ("Look what it was, then press Enter: forces come again. ", "s");
        palpate (hand, "clear");
      else
        rethrow (problem);
      endif
    end_try_catch
  until (done)
  printf ("%d,%s,%s,%d,%.6f\n", trial.trial, trial.stimulus, trial.response, trial.correct, trial.response_time_s);
  due = trial.next;
endwhile
palpate (hand, "close");

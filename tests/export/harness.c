/* Inputs from in.bin through a controller, outputs to out.bin. */
#include <stdio.h>
#include HEADER

static STATE self;
static double inputs[INPUTS + 1], outputs[OUTPUTS];

int main(void)
{
  FILE *in = fopen("in.bin", "rb"), *out = fopen("out.bin", "wb");
  if (!in || !out) return 3;
  RESET(&self, VALUES);
  while (fread(inputs, sizeof inputs, 1, in) == 1) {
    STEP;
    fwrite(outputs, sizeof outputs, 1, out);
  }
  fclose(in);
  fclose(out);
  return 0;
}

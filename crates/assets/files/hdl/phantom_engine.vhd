-- phantom_engine : kinematics, walls, torques and commands by one multiplier
--
-- The words of phantom_forward, cube_room, phantom_torque and command_scaler,
-- to the bit, from 22 products one after the other:
--
--   a, b := operands of the step   ->   product := a*b   ->   total := total + product
--
-- At a start edge all inputs are captured. In step k of the 32 that follow the
-- operands of product k are loaded; two steps later it is in the total, which is
-- narrowed when its sum is complete. A word can be an operand from the step
-- after that on, which orders the products:
--
--    1  L1*cosine2       7  stiffness*depth_y   13  (z + L1)*force_x   19  L1*upper
--    2  L2*sine3         8  stiffness*depth_x   14  -x*force_z         20  torque1*GAIN_1
--    3  -L2*cosine3      9  stiffness*depth_z   15  cosine2*force_y    21  L2*fore
--    4  L1*sine2        10  -                   16  -sine2*radial      22  torque2*GAIN_2
--    5  sine1*radius    11  sine1*force_x       17  sine3*force_y      23  -
--    6  cosine1*radius  12  cosine1*force_z     18  cosine3*radial     24  torque3*GAIN_3
--
-- generics PERIOD_WIDTH                   bits of the period, 2 to 30
--          DELAY                          edges from the first edge after reset
--                                         to the first start edge
--          TRIG_INT, TRIG_FRAC            format of the sines and cosines
--          LENGTH_FRAC                    fraction bits of the lengths, at most 30
--          LENGTH_1, LENGTH_2             L1, L2 in units of 2^-LENGTH_FRAC m
--          POSITION_INT, POSITION_FRAC    format of the positions
--          STIFFNESS_INT, STIFFNESS_FRAC  format of the stiffness
--          FORCE_INT, FORCE_FRAC          format of the forces
--          FORCE_LIMIT                    largest force, a word of that format
--          TORQUE_INT, TORQUE_FRAC        format of the torques
--          GAIN_1, GAIN_2, GAIN_3, GAIN_FRAC
--                                         GAIN_i / 2^GAIN_FRAC converter counts
--                                         per N.m of joint i
--          COMMAND_WIDTH                  bits of a command
-- in       sine1, cosine1, sine2, cosine2, sine3, cosine3 (1,TRIG_INT,TRIG_FRAC)
--          valid1, valid2, valid3 (0,1,0)
--          x_low, x_high, y_low, y_high, z_low, z_high
--                                  (1,POSITION_INT,POSITION_FRAC) [m]
--          room      (0,3,0)       the pairs of walls that are there
--          stiffness (0,STIFFNESS_INT,STIFFNESS_FRAC) [N/m]
--          period    (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
-- out      x, y, z, radius (1,POSITION_INT,POSITION_FRAC) [m]
--          force_x, force_y, force_z (1,FORCE_INT,FORCE_FRAC) [N] on the tip
--          contact (0,3,0)         the axes beyond a wall
--          torque1, torque2, torque3 (1,TORQUE_INT,TORQUE_FRAC) [N.m]
--          command1, command2, command3 (1,COMMAND_WIDTH-1,0) converter counts
-- latency  32 edges from the start edge to the edge that writes all outputs; a
--          start on or before that edge gives the running computation up, so a
--          period of 32 or less writes none. A new period takes effect at the
--          next start edge
-- reset    outputs 0, nothing running, countdown DELAY
-- overflow as in the four blocks; no sum overflows before it is narrowed
-- source   Sevcik et al. 2009, its equations; the schedule is this project's
-- differs from the hardware: the paper does not say how its logic is shared.
--          The emulator computes the words at the start edge and shows them 32
--          edges later: the ports are exact at every edge, the registers of the
--          multiplier are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity phantom_engine is
  generic (
    PERIOD_WIDTH   : positive range 2 to 30 := 24;
    DELAY          : natural  := 2;
    TRIG_INT       : natural  := 9;
    TRIG_FRAC      : natural  := 22;
    LENGTH_FRAC    : natural  := 24;
    LENGTH_1       : positive := 2348810;
    LENGTH_2       : positive := 2348810;
    POSITION_INT   : natural  := 0;
    POSITION_FRAC  : natural  := 24;
    STIFFNESS_INT  : natural  := 16;
    STIFFNESS_FRAC : natural  := 2;
    FORCE_INT      : natural  := 4;
    FORCE_FRAC     : natural  := 16;
    FORCE_LIMIT    : positive := 557056;
    TORQUE_INT     : natural  := 3;
    TORQUE_FRAC    : natural  := 20;
    GAIN_1         : natural  := 201134;
    GAIN_2         : natural  := 220289;
    GAIN_3         : natural  := 220289;
    GAIN_FRAC      : natural  := 3;
    COMMAND_WIDTH  : positive := 16
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    sine1     : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine1   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine2     : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine2   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine3     : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine3   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    valid1    : in  std_logic;
    valid2    : in  std_logic;
    valid3    : in  std_logic;
    x_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    x_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    room      : in  std_logic_vector(2 downto 0);
    stiffness : in  std_logic_vector(STIFFNESS_INT + STIFFNESS_FRAC - 1 downto 0);
    period    : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    x         : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y         : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z         : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    radius    : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    force_x   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_y   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_z   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    contact   : out std_logic_vector(2 downto 0);
    torque1   : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    torque2   : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    torque3   : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    command1  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command2  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command3  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of phantom_engine is

  constant LATENCY : positive := 32;

  constant TRIG_WIDTH      : positive := TRIG_INT + TRIG_FRAC + 1;
  constant POSITION_WIDTH  : positive := POSITION_INT + POSITION_FRAC + 1;
  constant STIFFNESS_WIDTH : positive := STIFFNESS_INT + STIFFNESS_FRAC;
  constant FORCE_WIDTH     : positive := FORCE_INT + FORCE_FRAC + 1;
  constant TORQUE_WIDTH    : positive := TORQUE_INT + TORQUE_FRAC + 1;

  subtype trig_word     is signed(TRIG_WIDTH - 1 downto 0);
  subtype position_word is signed(POSITION_WIDTH - 1 downto 0);
  subtype force_word    is signed(FORCE_WIDTH - 1 downto 0);
  subtype beam_word     is signed(FORCE_WIDTH downto 0);
  subtype torque_word   is signed(TORQUE_WIDTH - 1 downto 0);
  subtype command_word  is signed(COMMAND_WIDTH - 1 downto 0);

  -- Fraction bits of z before it is narrowed, and of the lever arms of joint 1:
  -- what is added there is aligned to the finer of the two.
  constant Z_FRAC   : natural := maximum(TRIG_FRAC + POSITION_FRAC, LENGTH_FRAC);
  constant Z_SHIFT  : natural := Z_FRAC - TRIG_FRAC - POSITION_FRAC;
  constant ARM_FRAC : natural := maximum(POSITION_FRAC, LENGTH_FRAC);

  -- The widest operands. a: a constant of 32 bits, a sine (for z shifted), the
  -- stiffness, or a lever arm. b: a sine, a position, a depth, a force or a torque.
  constant ARM_WIDTH : positive
    := maximum(POSITION_WIDTH + ARM_FRAC - POSITION_FRAC, 32 + ARM_FRAC - LENGTH_FRAC) + 1;
  constant A_WIDTH   : positive
    := maximum(maximum(32, ARM_WIDTH), maximum(TRIG_WIDTH + Z_SHIFT, STIFFNESS_WIDTH) + 1);
  constant B_WIDTH   : positive
    := maximum(maximum(TRIG_WIDTH, POSITION_WIDTH), maximum(FORCE_WIDTH, TORQUE_WIDTH)) + 1;

  -- Room for two products and an aligned length, and for either limit.
  constant TOTAL_WIDTH : positive
    := maximum(A_WIDTH + B_WIDTH, 32 + TRIG_FRAC + POSITION_FRAC) + 2;

  subtype a_word     is signed(A_WIDTH - 1 downto 0);
  subtype b_word     is signed(B_WIDTH - 1 downto 0);
  subtype total_word is signed(TOTAL_WIDTH - 1 downto 0);

  constant L1      : signed(31 downto 0) := to_signed(LENGTH_1, 32);
  constant L2      : signed(31 downto 0) := to_signed(LENGTH_2, 32);
  constant HIGHEST : command_word := '0' & (COMMAND_WIDTH - 2 downto 0 => '1');

  -- Drops `drop` bits (appends, when negative), rounding to nearest, ties up,
  -- and keeps the lower `width` bits.
  function narrow(value : total_word; drop : integer; width : positive) return signed is
    variable word : signed(TOTAL_WIDTH + abs drop + width downto 0);
  begin
    word := resize(value, word'length);
    if drop > 0 then
      word := shift_right(word + shift_left(to_signed(1, word'length), drop - 1), drop);
    else
      word := shift_left(word, -drop);
    end if;
    return word(width - 1 downto 0);
  end function;

  -- a > b, as the sign of b - a, so that an unknown word gives an unknown answer.
  function exceeds(a, b : position_word) return std_logic is
    constant DIFFERENCE : signed(POSITION_WIDTH downto 0) := resize(b, POSITION_WIDTH + 1) - a;
  begin
    return DIFFERENCE(DIFFERENCE'high);
  end function;

  function beyond(position, low, high : position_word) return std_logic is
  begin
    return exceeds(position, high) or exceeds(low, position);
  end function;

  -- How far beyond which wall: positive beyond the high one, negative beyond the
  -- low one. Gated instead of chosen, for the unknown words again.
  function depth(position, low, high : position_word) return b_word is
    constant WIDE       : b_word := resize(position, B_WIDTH);
    constant BEYOND_TOP : std_logic := exceeds(position, high);
    constant BEYOND_LOW : std_logic := exceeds(low, position) and not BEYOND_TOP;
  begin
    return signed((std_logic_vector(WIDE - high) and BEYOND_TOP)
                  or (std_logic_vector(WIDE - low) and BEYOND_LOW));
  end function;

  -- Rounded and clamped to the limit. An unknown value has no sign beyond either
  -- limit, and passes unknown.
  function spring(value : total_word; there : std_logic) return force_word is
    constant WIDTH   : positive := TOTAL_WIDTH + FORCE_WIDTH + 1;
    constant LIMIT   : signed(WIDTH - 1 downto 0) := to_signed(FORCE_LIMIT, WIDTH);
    constant ROUNDED : signed(WIDTH - 1 downto 0)
      := narrow(value, STIFFNESS_FRAC + POSITION_FRAC - FORCE_FRAC, WIDTH);
    constant ABOVE   : signed(WIDTH - 1 downto 0) := LIMIT - ROUNDED;
    constant BELOW   : signed(WIDTH - 1 downto 0) := LIMIT + ROUNDED;
    variable clamped : force_word;
  begin
    if ABOVE(ABOVE'high) = '1' then
      clamped := resize(LIMIT, FORCE_WIDTH);
    elsif BELOW(BELOW'high) = '1' then
      clamped := resize(-LIMIT, FORCE_WIDTH);
    else
      clamped := resize(ROUNDED, FORCE_WIDTH);
    end if;
    return signed(std_logic_vector(clamped) and there);
  end function;

  -- Rounded to a converter count and saturated. A value fits when it survives the
  -- way to COMMAND_WIDTH bits and back; compared as plain vectors, so that an
  -- unknown value stays unknown.
  function drive(value : total_word; on_all : std_logic) return command_word is
    constant WIDTH   : positive := TOTAL_WIDTH + COMMAND_WIDTH;
    constant ROUNDED : signed(WIDTH - 1 downto 0) := narrow(value, TORQUE_FRAC + GAIN_FRAC, WIDTH);
    constant WORD    : command_word := resize(ROUNDED, COMMAND_WIDTH);
    variable limited : command_word;
  begin
    if std_logic_vector(resize(WORD, WIDTH)) = std_logic_vector(ROUNDED) then
      limited := WORD;
    elsif ROUNDED(ROUNDED'high) = '1' then
      limited := not HIGHEST;
    else
      limited := HIGHEST;
    end if;
    return signed(std_logic_vector(limited) and on_all);
  end function;

begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to maximum(2 * (2**(PERIOD_WIDTH - 1) - 1), DELAY);
    -- The edges since the start, 0 when nothing is running.
    variable step      : natural range 0 to LATENCY;

    variable s1, c1, s2, c2, s3, c3 : trig_word;
    variable xl, xh, yl, yh, zl, zh : position_word;
    variable walls                  : std_logic_vector(2 downto 0);
    variable stiff                  : signed(STIFFNESS_WIDTH downto 0);
    variable on_all                 : std_logic;

    variable a       : a_word;
    variable b       : b_word;
    variable product : signed(A_WIDTH + B_WIDTH - 1 downto 0);
    variable total   : total_word;

    variable tip_x, tip_y, tip_z, reach : position_word;
    variable push_x, push_y, push_z     : force_word;
    variable touching                   : std_logic_vector(2 downto 0);
    variable radial, upper, fore        : beam_word;
    variable turn_1, turn_2, turn_3     : torque_word;
    variable drive_1, drive_2, drive_3  : command_word;
  begin
    if rising_edge(clk) then
      -- From the last stage to the first: these are registers, the old word
      -- leaves before the new one enters.
      total := total + product;
      case step is
        when 4 =>
          reach := narrow(total, LENGTH_FRAC + TRIG_FRAC - POSITION_FRAC, POSITION_WIDTH);
          total := shift_left(resize(L2, TOTAL_WIDTH), TRIG_FRAC);
        when 6 =>
          tip_y := narrow(total, LENGTH_FRAC + TRIG_FRAC - POSITION_FRAC, POSITION_WIDTH);
          total := (others => '0');
        when 7 =>
          tip_x := narrow(total, TRIG_FRAC, POSITION_WIDTH);
          total := shift_left(resize(-L1, TOTAL_WIDTH), Z_FRAC - LENGTH_FRAC);
        when 8 =>
          tip_z := narrow(total, Z_FRAC - POSITION_FRAC, POSITION_WIDTH);
          total := (others => '0');
        when 9 =>
          push_y := spring(total, walls(1));
          total  := (others => '0');
        when 10 =>
          push_x := spring(total, walls(0));
          total  := (others => '0');
        when 11 =>
          push_z := spring(total, walls(2));
          total  := (others => '0');
        when 14 =>
          radial := narrow(total, TRIG_FRAC, radial'length);
          total  := (others => '0');
        when 16 =>
          turn_1 := narrow(total, ARM_FRAC + FORCE_FRAC - TORQUE_FRAC, TORQUE_WIDTH);
          total  := (others => '0');
        when 18 =>
          upper := narrow(total, TRIG_FRAC, upper'length);
          total := (others => '0');
        when 20 =>
          fore  := narrow(total, TRIG_FRAC, fore'length);
          total := (others => '0');
        when 21 =>
          turn_2 := narrow(total, LENGTH_FRAC + FORCE_FRAC - TORQUE_FRAC, TORQUE_WIDTH);
          total  := (others => '0');
        when 22 =>
          drive_1 := drive(total, on_all);
          total   := (others => '0');
        when 23 =>
          turn_3 := narrow(total, LENGTH_FRAC + FORCE_FRAC - TORQUE_FRAC, TORQUE_WIDTH);
          total  := (others => '0');
        when 24 =>
          drive_2 := drive(total, on_all);
          total   := (others => '0');
        when 26 =>
          drive_3 := drive(total, on_all);
          total   := (others => '0');
        when others =>
          null;
      end case;

      product := a * b;

      -- Nothing to multiply is a product of 0.
      a := (others => '0');
      b := (others => '0');
      case step is
        when 1  => a := resize(L1, A_WIDTH);          b := resize(c2, B_WIDTH);
        when 2  => a := resize(L2, A_WIDTH);          b := resize(s3, B_WIDTH);
        when 3  => a := resize(-L2, A_WIDTH);         b := resize(c3, B_WIDTH);
        when 4  => a := resize(L1, A_WIDTH);          b := resize(s2, B_WIDTH);
        when 5  => a := resize(s1, A_WIDTH);          b := resize(reach, B_WIDTH);
        when 6  => a := shift_left(resize(c1, A_WIDTH), Z_SHIFT);
                   b := resize(reach, B_WIDTH);
        when 7  => a := -resize(stiff, A_WIDTH);      b := depth(tip_y, yl, yh);
        when 8  => a := -resize(stiff, A_WIDTH);      b := depth(tip_x, xl, xh);
        when 9  => a := -resize(stiff, A_WIDTH);      b := depth(tip_z, zl, zh);
        when 11 => a := resize(s1, A_WIDTH);          b := resize(push_x, B_WIDTH);
        when 12 => a := resize(c1, A_WIDTH);          b := resize(push_z, B_WIDTH);
        when 13 => a := shift_left(resize(tip_z, A_WIDTH), ARM_FRAC - POSITION_FRAC)
                        + shift_left(resize(L1, A_WIDTH), ARM_FRAC - LENGTH_FRAC);
                   b := resize(push_x, B_WIDTH);
        when 14 => a := -shift_left(resize(tip_x, A_WIDTH), ARM_FRAC - POSITION_FRAC);
                   b := resize(push_z, B_WIDTH);
        when 15 => a := resize(c2, A_WIDTH);          b := resize(push_y, B_WIDTH);
        when 16 => a := -resize(s2, A_WIDTH);         b := resize(radial, B_WIDTH);
        when 17 => a := resize(s3, A_WIDTH);          b := resize(push_y, B_WIDTH);
        when 18 => a := resize(c3, A_WIDTH);          b := resize(radial, B_WIDTH);
        when 19 => a := resize(L1, A_WIDTH);          b := resize(upper, B_WIDTH);
        when 20 => a := to_signed(GAIN_1, A_WIDTH);   b := resize(turn_1, B_WIDTH);
        when 21 => a := resize(L2, A_WIDTH);          b := resize(fore, B_WIDTH);
        when 22 => a := to_signed(GAIN_2, A_WIDTH);   b := resize(turn_2, B_WIDTH);
        when 24 => a := to_signed(GAIN_3, A_WIDTH);   b := resize(turn_3, B_WIDTH);
        when others => null;
      end case;

      if countdown = 0 then
        s1 := signed(sine1);
        c1 := signed(cosine1);
        s2 := signed(sine2);
        c2 := signed(cosine2);
        s3 := signed(sine3);
        c3 := signed(cosine3);
        xl := signed(x_low);
        xh := signed(x_high);
        yl := signed(y_low);
        yh := signed(y_high);
        zl := signed(z_low);
        zh := signed(z_high);

        walls   := room;
        stiff   := signed('0' & stiffness);
        on_all  := valid1 and valid2 and valid3;
        product := (others => '0');
        total   := (others => '0');
        a       := (others => '0');
        b       := (others => '0');

        step      := 1;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        if step = LATENCY then
          touching(0) := walls(0) and beyond(tip_x, xl, xh);
          touching(1) := walls(1) and beyond(tip_y, yl, yh);
          touching(2) := walls(2) and beyond(tip_z, zl, zh);

          x        <= std_logic_vector(tip_x);
          y        <= std_logic_vector(tip_y);
          z        <= std_logic_vector(tip_z);
          radius   <= std_logic_vector(reach);
          force_x  <= std_logic_vector(push_x);
          force_y  <= std_logic_vector(push_y);
          force_z  <= std_logic_vector(push_z);
          contact  <= touching;
          torque1  <= std_logic_vector(turn_1);
          torque2  <= std_logic_vector(turn_2);
          torque3  <= std_logic_vector(turn_3);
          command1 <= std_logic_vector(drive_1);
          command2 <= std_logic_vector(drive_2);
          command3 <= std_logic_vector(drive_3);

          step := 0;
        elsif step > 0 then
          step := step + 1;
        end if;
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        x        <= (others => '0');
        y        <= (others => '0');
        z        <= (others => '0');
        radius   <= (others => '0');
        force_x  <= (others => '0');
        force_y  <= (others => '0');
        force_z  <= (others => '0');
        contact  <= (others => '0');
        torque1  <= (others => '0');
        torque2  <= (others => '0');
        torque3  <= (others => '0');
        command1 <= (others => '0');
        command2 <= (others => '0');
        command3 <= (others => '0');

        step      := 0;
        countdown := DELAY;
      end if;
    end if;
  end process;

end architecture;
